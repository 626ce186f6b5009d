//! Messages that a window shows over its picture for a while.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Time that a message stays: long enough to read several lines.
const SHOWN_FOR: Duration = Duration::from_secs(10);
/// Number of messages that are shown at once: more would cover too much of the picture.
const MAX_SHOWN: usize = 4;

/// The last messages, oldest first.
#[derive(Debug, Default)]
pub struct Messages(VecDeque<(Instant, String)>);

impl Messages {
    /// Adds a message that came at `now`, and drops the oldest where there are too many. A message
    /// that is shown already stays for longer.
    pub fn push(&mut self, text: &str, now: Instant) {
        self.0.retain(|(_, shown)| shown != text.trim_end());
        if self.0.len() == MAX_SHOWN {
            self.0.pop_front();
        }
        self.0.push_back((now, text.trim_end().to_owned()));
    }

    /// Returns the messages to show at `now`, oldest first.
    pub fn at(&mut self, now: Instant) -> Vec<String> {
        self.0.retain(|(since, _)| now.saturating_duration_since(*since) < SHOWN_FOR);
        self.0.iter().map(|(_, text)| text.clone()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_stay_for_a_while_and_the_oldest_make_room() {
        let zero = Instant::now();
        let mut messages = Messages::default();
        (0..6).for_each(|i| messages.push(&format!("{i}\n"), zero + i * Duration::from_secs(1)));
        let at = |messages: &mut Messages, s| messages.at(zero + Duration::from_secs(s));
        assert_eq!(at(&mut messages, 6), ["2", "3", "4", "5"]);
        messages.push("3", zero + Duration::from_secs(7));
        assert_eq!(at(&mut messages, 7), ["2", "4", "5", "3"]);
        assert_eq!(at(&mut messages, 13), ["4", "5", "3"]);
        assert!(at(&mut messages, 17).is_empty());
    }
}
