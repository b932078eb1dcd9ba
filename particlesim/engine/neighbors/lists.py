"""Neighbors: the pair lists of a simulation, shared by all who can share them.

Who can is decided in every world by itself, so that a world has in a batch the rows that it has
alone, made and renewed at the same moments: its sums then run in the same order, bit for bit.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import warp as wp

from ...scene.part import Interaction
from ..model import Model
from ..state import State
from .all_pairs import AllPairs
from .blocks import by_size
from .own_reach import OwnReach
from .verlet import VerletList

SHARE = 1.25  # lists are shared up to this ratio of cutoffs: (5/4)^3 is twice the candidates


@dataclass
class Request:
    """What somebody asked for, and with whom each world alone would have it share a list.

    ``leader`` is, by world, the number of the request whose list this one shares, or its own; where
    a world asks for nothing it is -1. ``widest`` is what the list that it leads must reach there.
    ``half`` is, by world, half the cutoff of each of its members if they differ much, else None.
    """

    members: np.ndarray
    cutoff: np.ndarray | None
    for_constraint: bool
    leader: np.ndarray
    widest: np.ndarray
    half: list[np.ndarray | None]
    own: OwnReach | None
    served_by: AllPairs = field(init=False, repr=False)

    def meets(self, other: Request) -> np.ndarray:
        """In which worlds both share a list."""
        return (self.leader == other.leader) & (self.leader >= 0)

    def parts_from(self, other: Request) -> np.ndarray:
        """In which worlds each has a list of its own."""
        return (self.leader != other.leader) & (self.leader >= 0) & (other.leader >= 0)


class Rows:
    """Rows that are found in each substep, and made longer where they were too short.

    ``generation`` changes when they have moved to new arrays; ``overflow`` is set where one was
    full.
    """

    generation: int
    overflow: wp.array

    def lengthen(self) -> bool:
        """If a row was full: make room for as many as were found."""
        raise NotImplementedError

    def grow(self) -> bool:
        """If a row was full: make them longer, and again."""
        raise NotImplementedError


class Neighbors:
    """The pair lists of a simulation, shared by all who can share them."""

    def __init__(self, model: Model):
        self.model = model
        self.lists: list[AllPairs] = []
        self.verlet: list[VerletList] = []  # those with rows
        self.kept: list[Rows] = []  # what parts find by these lists in each substep
        self.requests: list[Request] = []
        self._of: dict[int, AllPairs] = {}

    def of(self, part: Interaction, names: Iterable[str] = ()) -> AllPairs:
        """The list of an interaction: of its ``group``, within its ``cutoff`` in each world.

        Requested when it is first asked for, which must be in ``prepare``, as must whatever names
        more arrays to have in slot order.
        """
        if id(part) not in self._of:
            members = self.model.members([peer.group for peer in part.peers], part.name)
            cutoffs = [peer.cutoff for peer in part.peers]
            cutoff = None if part.cutoff is None else np.array(cutoffs, float)
            self._of[id(part)] = self.request(part.name, members, cutoff, {"position", *names})
        found = self._of[id(part)]
        found.request(set(names))
        return found

    def request(
        self,
        user: str,
        members: np.ndarray,
        cutoff: np.ndarray | None,
        names: set[str],
        *,
        for_constraint: bool = False,
        half: np.ndarray | None = None,
        own: OwnReach | None = None,
    ) -> AllPairs:
        """The list for these members within ``cutoff`` (one a world; None: all pairs).

        ``names`` are the per-particle arrays to have in slot order. Lists of the same members
        are shared when their cutoffs are alike. Where the cutoff is 0 nothing is looked for.

        ``half`` is for members of sizes of their own: i and j are looked for within the sum of
        their halves, (members,), at most half the cutoff. ``own`` is for those whose reaches change
        in time, up to the cutoff; such a list is nobody else's.
        """
        worlds = self.model.world_count
        widest = np.zeros(worlds) if cutoff is None else cutoff.astype(float)
        halves = self._halves(members, half)
        new = Request(members, cutoff, for_constraint, np.full(worlds, -1), widest, halves, own)
        self._choose_leaders(new)
        found = self._fitting(new)
        if found is None:
            found = (AllPairs if cutoff is None else VerletList)(self.model, members)
            self.lists.append(found)
        if isinstance(found, VerletList):
            found.own = own
            mine = zip(new.half, found.half, strict=True)
            found.half = [theirs if ours is None else ours for ours, theirs in mine]
        found.request(names)
        found.users.append(user)
        for other in self.requests:
            # One pass for both, where they share, reads what both need from the list of the first.
            if other.served_by is not found and other.meets(new).any():
                other.served_by.request(names)
        new.served_by = found
        self.requests.append(new)
        return found

    def _halves(self, members: np.ndarray, half: np.ndarray | None) -> list[np.ndarray | None]:
        """By world those that differ so much that it pays to tell them apart."""
        worlds = np.arange(self.model.world_count)
        if half is None:
            return [None] * len(worlds)
        of_worlds = np.split(half, np.searchsorted(self.model.world_of[members], worlds[1:]))
        return [each if by_size(each) else None for each in of_worlds]

    def _choose_leaders(self, new: Request) -> None:
        """In each world the first list that the request can share there, else one of its own."""
        count = np.bincount(self.model.world_of[new.members], minlength=self.model.world_count)
        missing = (count > 0) & (new.widest > 0 if new.cutoff is not None else True)
        for k, other in enumerate(self.requests):
            shared = missing & (other.leader == k) & (new.own is other.own is None)
            if shared.any():
                shared &= self._same_members(new, other) & _alike(new, other)
                new.leader[shared] = k
                other.widest = np.where(shared, np.maximum(other.widest, new.widest), other.widest)
                missing &= ~shared
        new.leader[missing] = len(self.requests)

    def _same_members(self, new: Request, other: Request) -> np.ndarray:
        """In which worlds both look at the same particles."""
        worlds = np.arange(self.model.world_count)
        if np.array_equal(new.members, other.members):
            return worlds >= 0
        ours, theirs = (
            np.split(each.members, np.searchsorted(self.model.world_of[each.members], worlds[1:]))
            for each in (new, other)
        )
        return np.array([np.array_equal(*pair) for pair in zip(ours, theirs, strict=True)])

    def _fitting(self, new: Request) -> AllPairs | None:
        """The list that serves whom each world would have the request share with, and no others."""
        for each in self.lists:
            served = [other for other in self.requests if other.served_by is each]
            if (
                new.own is served[0].own is None
                and np.array_equal(each.members_host, new.members)
                and (new.cutoff is None) == (served[0].cutoff is None)
                and not any(new.parts_from(other).any() for other in served)
            ):
                return each
        return None

    def _agree(self) -> None:
        """Tell each list what the worlds' own lists reach, and when those are renewed."""
        for each in self.lists:
            served = [other for other in self.requests if other.served_by is each]
            each.leader = np.max([other.leader for other in served], axis=0)
            cutoff = np.zeros(self.model.world_count)
            for k, other in enumerate(self.requests):
                cutoff = np.where(each.leader == k, other.widest, cutoff)
            for other in self.requests:
                phase = each.for_constraints if other.for_constraint else each.for_interactions
                phase |= (other.leader == each.leader) & (other.leader >= 0)
            if isinstance(each, VerletList):
                each.cutoff = cutoff

    def allocate(self, state: State) -> None:
        """Make all lists, once every user has asked."""
        self._agree()
        self.verlet = [each for each in self.lists if isinstance(each, VerletList)]
        for each in self.lists:
            each.allocate(state)

    def update(self, state: State, among: wp.array | None = None) -> None:
        """Before the interactions: bring their lists up to date.

        ``among``: of worlds where it is not 0 alone; the others are not to be asked then.
        """
        for each in self.lists:
            if each.for_interactions.any():
                each.update(state, among=among)

    def update_for_constraints(self, state: State) -> None:
        """After integration: bring the constraints' lists up to date."""
        for each in self.lists:
            if each.for_constraints.any():
                each.update(state, for_constraint=True)

    def renew(self, state: State, worlds: list[int]) -> None:
        """The positions of these worlds were written from outside: make their rows anew."""
        for each in self.verlet:
            each.renew(state, worlds)

    @property
    def _rows(self) -> list[Any]:
        return [*self.verlet, *self.kept]

    @property
    def generation(self) -> int:
        """Changes when rows have moved to new arrays; what was recorded before is then void."""
        return sum(each.generation for each in self._rows)

    @property
    def overflowing(self) -> bool:
        """Some row was full."""
        return any(each.overflow.numpy()[0] for each in self._rows)

    def lengthen(self) -> None:
        """Make room in the rows that were full; whoever calls has them made again."""
        for each in self._rows:
            each.lengthen()

    def grow(self) -> bool:
        """Lengthen the rows that were full; True if some were and the step must be redone."""
        return any([each.grow() for each in self._rows])


def _alike(new: Request, other: Request) -> np.ndarray:
    """In which worlds one list can serve both cutoffs."""
    if new.cutoff is None or other.cutoff is None:
        return np.full(len(new.leader), new.cutoff is other.cutoff)
    least, most = np.minimum(new.widest, other.widest), np.maximum(new.widest, other.widest)
    sized = [
        (ours is None) == (theirs is None)
        for ours, theirs in zip(new.half, other.half, strict=True)
    ]
    return (most <= SHARE * least) & sized
