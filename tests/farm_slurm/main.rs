//! `nimbus farm` on a real Slurm with four nodes, in network namespaces of this machine
//! (tools/slurm-test-cluster). Nodes lose their power and their network in the middle of shards,
//! and the controller is restarted. Needs root, and what `tools/bootstrap tests` installs.

mod failures;
mod handover;
mod harness;
mod results;
mod submission;
