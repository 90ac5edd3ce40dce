//! Names that a language has taken: a module of that name would hide what its own code imports, or not compile.

use super::Language;

/// Modules of the standard library of Python 3.11 (`sys.stdlib_module_names`), lower-case ones without underscore in front.
const PYTHON: &str = "abc aifc argparse array ast asynchat asyncio asyncore atexit audioop base64 bdb binascii bisect builtins \
     bz2 calendar cgi cgitb chunk cmath cmd code codecs codeop collections colorsys compileall concurrent \
     configparser contextlib contextvars copy copyreg crypt csv ctypes curses dataclasses datetime dbm \
     decimal difflib dis distutils doctest email encodings ensurepip enum errno faulthandler fcntl filecmp \
     fileinput fnmatch fractions ftplib functools gc genericpath getopt getpass gettext glob graphlib grp \
     gzip hashlib heapq hmac html http idlelib imaplib imghdr imp importlib inspect io ipaddress itertools \
     json keyword lib2to3 linecache locale logging lzma mailbox mailcap marshal math mimetypes mmap \
     modulefinder msilib msvcrt multiprocessing netrc nis nntplib nt ntpath nturl2path numbers opcode \
     operator optparse os ossaudiodev pathlib pdb pickle pickletools pipes pkgutil platform plistlib poplib \
     posix posixpath pprint profile pstats pty pwd py_compile pyclbr pydoc pydoc_data pyexpat queue quopri \
     random re readline reprlib resource rlcompleter runpy sched secrets select selectors shelve shlex shutil \
     signal site smtpd smtplib sndhdr socket socketserver spwd sqlite3 sre_compile sre_constants sre_parse \
     ssl stat statistics string stringprep struct subprocess sunau symtable sys sysconfig syslog tabnanny \
     tarfile telnetlib tempfile termios textwrap this threading time timeit tkinter token tokenize tomllib \
     trace traceback tracemalloc tty turtle turtledemo types typing unicodedata unittest urllib uu uuid venv \
     warnings wave weakref webbrowser winreg winsound wsgiref xdrlib xml xmlrpc zipapp zipfile zipimport zlib \
     zoneinfo";

/// Words of the language Python.
const PYTHON_WORDS: &str = "and as assert async await break class continue def del elif else except finally for from global if in is \
     lambda nonlocal not or pass raise return try while with yield";

/// Crates that come with the compiler, and words of the language Rust.
const RUST: &str = "abstract alloc as async await become box break const continue core crate do dyn else enum extern false \
     final fn for gen if impl in let loop macro match mod move mut override priv proc_macro pub ref return \
     self static std struct super test trait true try type typeof unsafe unsized use virtual where while \
     yield";

/// What a module of this name would be in the way of; None: nothing.
pub(super) fn taken(name: &str, language: Language) -> Option<&'static str> {
    let file = name.replace('-', "_");
    let among = |words: &str| words.split_ascii_whitespace().any(|word| word == file);
    match language {
        Language::Python if file == "terraglue" || file.starts_with("terraglue_") => {
            Some("the library that a module in Python imports")
        }
        Language::Python if among(PYTHON) => Some("a module of Python's standard library"),
        Language::Python if among(PYTHON_WORDS) => Some("a word of the language Python"),
        Language::Rust if among(RUST) => Some("a crate or a word of the language Rust"),
        _ => None,
    }
}
