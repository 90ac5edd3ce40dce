//! Independent runs side by side, with a progress bar on a terminal.

use indicatif::{ProgressBar, ProgressStyle};
use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

thread_local! {
    /// Whether other jobs run beside that of this thread: two bars would overwrite each other.
    static IS_BESIDE_OTHERS: Cell<bool> = const { Cell::new(false) };
}

/// `job` on every item, on as many threads as there are processors; answers in the order of the items.
pub fn in_parallel<T: Sync, R: Send>(items: &[T], job: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let style = ProgressStyle::with_template("{bar:32} {pos} of {len} runs  {eta} left");
    let bar = match IS_BESIDE_OTHERS.get() {
        true => ProgressBar::hidden(),
        false => ProgressBar::new(items.len() as u64),
    };
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let counted = |item: &T| {
        let answer = job(item);
        bar.inc(1);
        answer
    };
    let mut answers = Vec::with_capacity(items.len());
    in_order(processors(), items, counted, |_, answer| answers.push(answer));
    bar.finish_and_clear();
    answers
}

/// Number of processors.
pub fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// `job` on every item, on so many threads; `each` gets the answers in the order of the items, as soon as they are there.
pub fn in_order<T: Sync, R: Send>(
    threads: usize,
    items: &[T],
    job: impl Fn(&T) -> R + Sync,
    mut each: impl FnMut(&T, R),
) {
    let next = AtomicUsize::new(0);
    let (sender, receiver) = mpsc::channel();
    let (next, job) = (&next, &job);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            let sender = sender.clone();
            scope.spawn(move || {
                IS_BESIDE_OTHERS.set(threads > 1);
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(k) else { return };
                    // the receiver ends after all of them
                    drop(sender.send((k, job(item))));
                }
            });
        }
        drop(sender);
        let mut early = BTreeMap::new();
        let mut shown = 0;
        for (k, answer) in receiver {
            early.insert(k, answer);
            while let Some(answer) = early.remove(&shown) {
                each(&items[shown], answer);
                shown += 1;
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_come_in_the_order_of_the_items() {
        for threads in [1, 3] {
            let items: Vec<u64> = (0..20).collect();
            let mut answers = Vec::new();
            let slow_first = |x: &u64| {
                std::thread::sleep(std::time::Duration::from_millis((20 - x) / 4));
                x * x
            };
            in_order(threads, &items, slow_first, |x, square| answers.push((*x, square)));
            assert_eq!(answers, items.iter().map(|x| (*x, x * x)).collect::<Vec<_>>());
        }
    }
}
