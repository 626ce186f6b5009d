//! Lists of shard numbers in the form that Slurm's `--array` takes.

/// Returns ascending numbers as ranges, such as "0,3-5".
pub fn ranges(indices: &[usize]) -> String {
    let runs = indices.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
        [first, .., last] => format!("{first}-{last}"),
        [one] => one.to_string(),
        [] => String::new(),
    });
    runs.collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::ranges;

    #[test]
    fn runs_of_numbers_become_ranges() {
        assert_eq!(ranges(&[0, 2, 3, 4, 6]), "0,2-4,6");
        assert_eq!(ranges(&[]), "");
    }
}
