//! Summaries and pictures: plain data in, no solver known.
