"""What kind of motion two recordings hold, and what an answer may then say."""
