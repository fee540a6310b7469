//! Plain twins of the morphological operations.
