//! groundloop
