//! The command from outside: keys, exit statuses, files, on real maps and logs.

mod bad_input;
mod camera;
mod commands;
mod nav;
mod devices;
mod emulate;
mod run;
mod run_log;
mod uri;
