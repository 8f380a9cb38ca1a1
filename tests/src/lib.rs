//! End-to-end tests of the DOSE3 workspace live in `tests/tests`.
