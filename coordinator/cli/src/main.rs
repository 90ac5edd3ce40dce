//! The program `terraglue`: arguments in, tables and files out.

fn main() -> std::process::ExitCode {
    terraglue_cli::main()
}
