//! Rigid bodies in maximal coordinates with Lagrange multipliers and complementarity contact.
