"""Names of variables by patterns."""

import difflib
import re

from .errors import UnknownName


def matching(names, patterns):
    """The names that match, pattern by pattern; each `*` matches within one dotted part.

        matching(testbed.names, ["robot.body.z", "robot.*_j2.angle"])
    """
    found = []
    for pattern in [patterns] if isinstance(patterns, str) else patterns:
        form = re.compile("[^.]*".join(re.escape(part) for part in pattern.split("*")))
        own = [name for name in names if form.fullmatch(name)]
        if not own:
            near = difflib.get_close_matches(pattern, names, 1)
            raise UnknownName(f"no variable matches `{pattern}`" + (f"; did you mean `{near[0]}`?" if near else ""))
        found += own
    return found
