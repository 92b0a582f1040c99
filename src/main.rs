//! groundloop
fn main() {}
