//! What a flow has found at single times of its window: the search for switches asks for the same times again.

use std::cell::RefCell;
use std::rc::Rc;

/// Results by time.
#[derive(Debug)]
pub(super) struct Values<T>(RefCell<Vec<(f64, Rc<T>)>>);

impl<T> Default for Values<T> {
    fn default() -> Self {
        Values(RefCell::default())
    }
}

impl<T> Values<T> {
    /// The result at `t`, which is computed the first time.
    pub fn at(&self, t: f64, compute: impl FnOnce() -> T) -> Rc<T> {
        let mut known = self.0.borrow_mut();
        if let Some((_, value)) = known.iter().find(|(s, _)| *s == t) {
            return value.clone();
        }
        let new = Rc::new(compute());
        known.push((t, new.clone()));
        new
    }

    /// Forget all.
    pub fn clear(&self) {
        self.0.borrow_mut().clear();
    }

    /// Forget all but the result at `t`.
    pub fn keep(&self, t: f64) {
        self.0.borrow_mut().retain(|(s, _)| *s == t);
    }
}
