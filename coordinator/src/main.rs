//! The program `terraglue`: arguments in, tables and files out. The simulation is in the library.

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
