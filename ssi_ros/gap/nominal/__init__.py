"""What is believed before the record: a model, or a recording."""
