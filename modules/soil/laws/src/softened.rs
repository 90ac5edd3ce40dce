//! Depths at which unloading is softer than a law: found once for a soil and reported to its user.

use crate::pressure_law::PressureLaw;
use crate::straight::STIFFEST;
use terraglue_subsystem::Result;

/// Slopes over that of unloading up to which a law need not be looked at again for every size of a contact.
const GENTLE: f64 = 0.9;
/// Sizes of contacts for which a law is checked, m.
const SIZES: [f64; 12] = [0.001, 0.002, 0.004, 0.008, 0.015, 0.03, 0.06, 0.12, 0.25, 0.5, 1.0, 2.0];

/// Size of a small foot (m), under which a law is checked for [`Softened`].
pub const SMALL_CONTACT: f64 = 0.02;
/// Sinkage up to which the plate tests behind the laws are valid, m.
pub const DEEPEST_TESTED: f64 = 0.3;

/// A law that is stiffer than unloading above [`DEEPEST_TESTED`] under a contact of size [`SMALL_CONTACT`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Softened {
    /// Depth from which first loading goes on straight, m.
    pub from: f64,
    /// Elastic stiffness that leaves the law as it is, Pa/m.
    pub needed: f64,
    /// That which the soil has, Pa/m.
    pub stiffness: f64,
}

impl Softened {
    /// Message to the user; `whose` follows "law", e.g. " of label 1".
    pub fn message(&self, whose: &str) -> String {
        format!(
            "`elastic_stiffness_pa_m` = {:e} is softer than the law{whose} from {:.3} mm on under a contact of b = {} mm; first \
             loading goes on straight there, or unloading would yield energy; {:.1e} leaves the law as it is down to {} mm",
            self.stiffness,
            1e3 * self.from,
            1e3 * SMALL_CONTACT,
            self.needed,
            1e3 * DEEPEST_TESTED
        )
    }
}

impl PressureLaw {
    /// Whether first loading is stiffer than unloading with `k_u` (Pa/m) at a depth that feet reach; `None`, too, where a
    /// module has no answer: no foot may ever stand there.
    pub fn softened(&self, k_u: f64) -> Option<Softened> {
        self.softening(k_u).ok().flatten()
    }

    fn softening(&self, k_u: f64) -> Result<Option<Softened>> {
        let (b, down_to) = (SMALL_CONTACT, DEEPEST_TESTED);
        let from = self.curve(b, k_u)?.straight_from();
        if from >= down_to {
            return Ok(None);
        }
        // above an elastic line that is much stiffer the law stands alone
        let own = self.curve(b, 1e6 * k_u)?;
        let steps = 200;
        let z = |k: i32| from + (down_to - from) * f64::from(k) / f64::from(steps);
        let mut steepest = own.first_loading(down_to)?.1;
        for k in 1..=steps {
            steepest = steepest.max((own.virgin(z(k))? - own.virgin(z(k - 1))?) / (z(k) - z(k - 1)));
        }
        // rounded up to the two digits of the message
        let needed = 1.1 * steepest.max(STIFFEST * k_u) / STIFFEST;
        Ok(Some(Softened { from, needed, stiffness: k_u }))
    }

    /// The same law, which remembers where it is gentle under contacts of all sizes: curves above unloading with `k_u` (Pa/m)
    /// are then not looked at again.
    pub fn looked_at(self, k_u: f64) -> Self {
        let goes = |b: f64, k_u: f64| self.curve(b, k_u).is_ok_and(|c| c.straight_from() == f64::INFINITY);
        let gentle = SIZES.iter().all(|b| goes(*b, k_u) && goes(*b, k_u / STIFFEST * GENTLE));
        match self {
            Self::Expression(law) if gentle => Self::Expression(law.gentle_at(k_u)),
            Self::Plugin(law) if gentle => Self::Plugin(law.gentle_at(k_u)),
            other => other,
        }
    }
}
