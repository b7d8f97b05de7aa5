"""What a record will show before it exists, for those who plan a test."""
