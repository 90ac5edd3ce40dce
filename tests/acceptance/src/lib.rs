//! Tests of whole runs, as a user would start them.
