"""A part of any source."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ffd_lightning.data.sources.base import Source, SourceShape, Survey
from ffd_lightning.errors import ConfigError


@dataclass(frozen=True)
class LimitedSource:
    """A source of which only some shapes of each category are taken, evenly spread over their ids.

    Args:
        source: the whole.
        limit: how many at most.
    """

    source: Source
    limit: int

    def __post_init__(self) -> None:
        if self.limit < 1:
            raise ConfigError(f"limit={self.limit} must be 1 or more")

    def categories(self) -> list[str]:
        """See `Source`."""
        return self.source.categories()

    def shape_ids(self, category: str) -> list[str]:
        """Return `limit` ids of a category, sorted; all where there are fewer."""
        ids = self.source.shape_ids(category)
        count = min(self.limit, len(ids))
        return [ids[k * len(ids) // count] for k in range(count)]

    def load(self, category: str, shape_id: str) -> SourceShape:
        """See `Source`."""
        return self.source.load(category, shape_id)

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return what decides the shapes: that of the whole, and the limit."""
        return {**self.source.fingerprint(category), "limit": self.limit}

    def survey(self, category: str) -> Survey:
        """Return what there is to say of the whole, and the faults of the shapes that are taken."""
        survey, taken = self.source.survey(category), set(self.shape_ids(category))
        faults = {i: why for i, why in survey.faults.items() if i in taken}
        return replace(survey, faults=faults)

    def split(self, category: str) -> dict[str, str]:
        """See `Source`."""
        return self.source.split(category)
