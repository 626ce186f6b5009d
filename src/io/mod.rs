//! Text and containers to plain data, and results to files.
