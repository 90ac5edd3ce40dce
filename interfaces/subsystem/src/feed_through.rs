//! Which outputs at the end of a step follow which inputs of that step at once.

/// An output, or all elements of an array, and the inputs that it follows at once: without a state between.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FeedThrough {
    /// Ids of the outputs: the first, and the one behind the last.
    pub outputs: [u32; 2],
    /// Ids of the inputs, likewise, in ascending order.
    pub inputs: Vec<[u32; 2]>,
}

impl FeedThrough {
    /// Every input, where it is not known which.
    pub const ALL: [u32; 2] = [0, u32::MAX];

    /// Whether the outputs follow an input.
    pub fn follows(&self, input: u32) -> bool {
        let behind = self.inputs.partition_point(|[first, _]| *first <= input);
        behind > 0 && input < self.inputs[behind - 1][1]
    }
}

#[cfg(test)]
mod tests {
    use super::FeedThrough;

    #[test]
    fn an_input_is_found_in_its_range() {
        let rows = FeedThrough { outputs: [0, 1], inputs: vec![[2, 4], [7, 8]] };
        let found: Vec<u32> = (0..10).filter(|input| rows.follows(*input)).collect();
        assert_eq!(found, [2, 3, 7]);
        assert!(FeedThrough { outputs: [0, 1], inputs: vec![FeedThrough::ALL] }.follows(5));
        assert!(!FeedThrough { outputs: [0, 1], inputs: Vec::new() }.follows(0));
    }
}
