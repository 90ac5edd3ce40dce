//! Answers of a law without state to what it was asked before: the same depths and slips come again in every trial of a
//! step, when it is accepted, and while a foot rests.

use super::calls::Call;

/// Most nodes of a call whose answer is kept.
const NODES: usize = 64;
/// Answers to single nodes and to more, powers of two.
const SINGLES: usize = 1 << 13;
const ROWS: usize = 1 << 7;

/// Arguments of a law: one or two numbers of each node, or one of all and one of each.
pub struct LawQuestion<'a> {
    /// Which function.
    pub function: Call,
    /// Length of the step, s.
    pub h: f64,
    /// Arguments, the last array with an entry per node.
    pub given: [&'a [f64]; 2],
}

impl LawQuestion<'_> {
    fn nodes(&self) -> usize {
        self.given[1].len()
    }

    /// As words, with zeros behind them.
    fn words<const Q: usize>(&self) -> [u64; Q] {
        let mut words = [0; Q];
        let head = [(self.function as u64) << 32 | self.nodes() as u64, self.h.to_bits()];
        let given = self.given.iter().flat_map(|array| array.iter().map(|x| x.to_bits()));
        words.iter_mut().zip(head.into_iter().chain(given)).for_each(|(word, x)| *word = x);
        words
    }
}

/// A table of answers of A numbers to questions of Q words, each at a place that follows from the question.
struct Table<const Q: usize, const A: usize>(Box<[([u64; Q], [f64; A])]>);

impl<const Q: usize, const A: usize> Table<Q, A> {
    fn new(places: usize) -> Self {
        // no question is all zeros: no call has the number 0
        Self(vec![([0; Q], [0.0; A]); places].into())
    }

    /// By FNV-1a over whole words.
    fn place(&mut self, asked: &[u64; Q]) -> &mut ([u64; Q], [f64; A]) {
        let mix = |hash: u64, word: &u64| (hash ^ word ^ (word >> 29)).wrapping_mul(0x0100_0000_01b3_9e37);
        let hash = asked.iter().fold(0xcbf2_9ce4_8422_2325, mix);
        let last = self.0.len() - 1;
        &mut self.0[(hash >> 40) as usize & last]
    }

    /// Writes what is known into `out`, array after array; the number behind them. None: not known.
    fn recall(&mut self, question: &LawQuestion, out: &mut [&mut [f64]]) -> Option<f64> {
        let asked = question.words();
        let (kept, answer) = self.place(&asked);
        if *kept != asked {
            return None;
        }
        let mut answer = answer.iter();
        out.iter_mut().flat_map(|array| array.iter_mut()).zip(&mut answer).for_each(|(out, x)| *out = *x);
        answer.next().copied()
    }

    fn keep(&mut self, question: &LawQuestion, out: &[&[f64]], last: f64) {
        let asked = question.words();
        let place = self.place(&asked);
        place.0 = asked;
        let all = out.iter().flat_map(|array| array.iter().copied()).chain([last]);
        place.1.iter_mut().zip(all).for_each(|(answer, x)| *answer = x);
    }
}

/// All answers that are kept.
pub struct Answers {
    singles: Table<4, 4>,
    rows: Table<{ 2 + 2 * NODES }, { 3 * NODES + 1 }>,
}

impl Answers {
    /// None so far.
    pub fn new() -> Self {
        Self { singles: Table::new(SINGLES), rows: Table::new(ROWS) }
    }

    /// Writes what is known into `out`; the longest step, s. None: it was not asked this, or not lately.
    pub fn recall(&mut self, question: &LawQuestion, out: &mut [&mut [f64]]) -> Option<f64> {
        match question.nodes() {
            1 => self.singles.recall(question, out),
            2..=NODES => self.rows.recall(question, out),
            _ => None,
        }
    }

    /// Keeps an answer and the longest step, s.
    pub fn keep(&mut self, question: &LawQuestion, out: &[&[f64]], longest: f64) {
        match question.nodes() {
            1 => self.singles.keep(question, out, longest),
            2..=NODES => self.rows.keep(question, out, longest),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_very_same_question_has_the_answer() {
        let mut answers = Answers::new();
        let depth: Vec<f64> = (0..NODES).map(|k| 0.01 * k as f64).collect();
        for n in [1, 2, NODES] {
            let b = [0.05];
            let asked =
                |h: f64, n: usize| LawQuestion { function: Call::Pressure, h, given: [&b, &depth[..n]] };
            let (p, slope) = (vec![2.0; n], vec![3.0; n]);
            let (mut p_out, mut slope_out) = (vec![0.0; n], vec![0.0; n]);
            let mut recall = |question: &LawQuestion, answers: &mut Answers| {
                answers.recall(question, &mut [&mut p_out, &mut slope_out])
            };
            assert_eq!(recall(&asked(1e-3, n), &mut answers), None);
            answers.keep(&asked(1e-3, n), &[&p, &slope], 7.0);
            assert_eq!(recall(&asked(1e-3, n), &mut answers), Some(7.0));
            assert_eq!(recall(&asked(2e-3, n), &mut answers), None);
            let other = LawQuestion { function: Call::Shear, ..asked(1e-3, n) };
            assert_eq!(recall(&other, &mut answers), None);
            assert_eq!((p_out, slope_out), (p, slope));
        }
        let many = vec![0.0; NODES + 1];
        let too_many = LawQuestion { function: Call::Shear, h: 1e-3, given: [&many, &many] };
        answers.keep(&too_many, &[&many, &many, &many], 1.0);
        assert_eq!(answers.recall(&too_many, &mut []), None);
    }
}
