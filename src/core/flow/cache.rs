//! Results that are dear to compute and large to keep: the least recently used go first.

use std::collections::HashMap;
use std::hash::Hash;

/// A cache with a budget of bytes.
#[derive(Debug)]
pub struct Cache<K, V> {
    known: HashMap<K, Entry<V>>,
    budget: usize,
    bytes: usize,
    clock: u64,
}

#[derive(Debug)]
struct Entry<V> {
    value: V,
    bytes: usize,
    used: u64,
}

impl<K: Eq + Hash + Clone, V> Cache<K, V> {
    /// An empty cache.
    pub fn new(budget: usize) -> Self {
        Cache { known: HashMap::new(), budget, bytes: 0, clock: 0 }
    }

    /// What is known, which is now used.
    pub fn get_mut(&mut self, key: &K) -> Option<&mut V> {
        self.clock += 1;
        let entry = self.known.get_mut(key)?;
        entry.used = self.clock;
        Some(&mut entry.value)
    }

    /// Keep a value; others leave while all together are above the budget. The newest always stays.
    pub fn insert(&mut self, key: K, value: V, bytes: usize) {
        self.clock += 1;
        let entry = Entry { value, bytes, used: self.clock };
        self.bytes += bytes;
        if let Some(old) = self.known.insert(key, entry) {
            self.bytes -= old.bytes;
        }
        while self.bytes > self.budget && self.known.len() > 1 {
            let Some(oldest) =
                self.known.iter().min_by_key(|(_, e)| e.used).map(|(k, _)| k.clone())
            else {
                return;
            };
            self.bytes -= self.known.remove(&oldest).map_or(0, |e| e.bytes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_recently_used_leaves_first() {
        let mut cache = Cache::new(30);
        (0..3).for_each(|k| cache.insert(k, k, 10));
        assert!(cache.get_mut(&0).is_some());
        cache.insert(3, 3, 10);
        let left: Vec<i32> = (0..4).filter(|k| cache.known.contains_key(k)).collect();
        assert_eq!(left, [0, 2, 3]);
        // one that is larger than the budget stays alone
        cache.insert(4, 4, 100);
        assert_eq!((cache.known.len(), cache.bytes), (1, 100));
        cache.insert(4, 5, 20);
        assert_eq!((cache.bytes, cache.get_mut(&4)), (20, Some(&mut 5)));
    }
}
