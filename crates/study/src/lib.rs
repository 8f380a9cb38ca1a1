//! The study: data sets and roles of logs, networks, rows, splits, experiments and their records, injected faults,
//! learned baselines, and the tables, page and figures that are made of what was measured.

#[macro_use]
pub mod said;

pub mod benchmark;
mod cells;
pub mod data;
pub mod faults;
pub mod joint;
pub mod learned;
pub mod live;
pub mod networks;
mod numbers;
pub mod options;
mod paper;
mod passes;
mod plain;
mod progress;
pub mod provenance;
pub mod reproduction;
pub mod roles;
mod rows;
mod sets;
mod split;
pub mod training;
pub mod verdicts;
