//! The tests of the board's core, by what the board does.

mod board;
mod bounds;
mod coils;
mod common;
mod config_store;
mod corners;
mod deadlines;
mod drivers;
mod extremes;
mod following;
mod guards;
mod hardware;
mod home;
mod law;
mod law_worker;
mod mean;
mod params;
mod plan;
mod requests;
mod segment;
mod servo;
mod soft_float;
mod states;
mod stops;
mod telemetry;
mod wiring;
