//! The command from outside: keys, exit statuses, files, on real maps and logs.

mod bad_input;
mod camera;
mod commands;
mod devices;
mod emulate;
mod explore;
mod floorplan;
mod locate;
mod nav;
mod nav_command;
mod nav_drive;
mod nav_sweep;
mod nav_trouble;
mod nav_worlds;
mod report;
mod run;
mod run_log;
mod uri;
