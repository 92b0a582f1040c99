//! The `groundloop` program; everything is in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    groundloop::cli::main()
}
