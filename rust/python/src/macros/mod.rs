//! What the classes and functions of the binding have in common, each written once.

mod results;
mod settings;

pub use results::{Column, Field, Value, as_dict, as_html, as_many, as_text, equally_many, hash_of, reduced, row_at};
pub(crate) use results::{batch, fields_shown, results};
pub use settings::{Argument, Setting, call, keywords, values};
pub(crate) use settings::{choices, settings, settings_class};

/// An array or a cloud, by the type of its numbers.
#[derive(Clone, Copy)]
pub enum ByType<S, D> {
    /// float32
    Single(S),
    /// float64
    Double(D),
}

/// The same work on float32 and on float64.
macro_rules! for_each_type {
    ($numbers:expr, $view:ident => $work:expr) => {
        match $numbers {
            $crate::macros::ByType::Single($view) => $work,
            $crate::macros::ByType::Double($view) => $work,
        }
    };
}
pub(crate) use for_each_type;
