"""
Inputs of a model that were recorded beside its channels: what they make of a record is predicted.

Their rows come first among the channels of record and expected spectrum. They are as they are, so
that only what the channels are, given the inputs, counts as evidence.
"""
