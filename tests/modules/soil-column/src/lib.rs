//! Independent soil columns, one per port: the smallest soil with a closed solution, for tests.
