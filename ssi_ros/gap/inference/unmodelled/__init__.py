"""The test for changes of a model that no effect of the library makes."""
