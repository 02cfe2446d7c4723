//! Contact methods side by side: table, CSV, picture.

mod csv;
mod json;
mod picture;
mod text;

pub use csv::csv;
pub use json::json;
pub use picture::picture;
pub use text::text;
