"""What the modes of two recordings say of the difference between them."""
