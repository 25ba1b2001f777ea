"""Slows down the guessing of passwords without affecting other users."""

import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from ipaddress import IPv6Address, ip_address
from typing import TypeVar

#: Wrong passwords for one account from one address that cost nothing; each further one doubles the wait.
_FREE = 5
_LONGEST_WAIT = 60.0
#: Wrong passwords from one address, whatever the account, before it waits; so many a second are forgotten.
_FREE_OF_ADDRESS = 60.0
_FORGOTTEN_OF_ADDRESS = 0.2
#: The same for one account from all addresses that never logged in to it; those that did are not held up.
_FREE_OF_ACCOUNT = 60.0
_FORGOTTEN_OF_ACCOUNT = 0.5
#: What an account under attack from many addresses costs those who come to it from a new one (s).
SLOW = 2.0
#: Wrong passwords are forgotten after this time (s).
_KEPT = 900.0
#: Entries kept of each kind: the oldest go first.
_MOST = 10_000

_Key = tuple[str, str]
_Value = TypeVar("_Value")


@dataclass
class _Guesses:
    wrong: float
    last: float


class LoginThrottle:
    """Counts wrong passwords by account and address; `clock` gives a time (s) that only grows.

    Who guesses at one account waits at that account only. Its memory is bounded, however many names and addresses come.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._pairs: OrderedDict[_Key, _Guesses] = OrderedDict()
        self._addresses: OrderedDict[_Key, _Guesses] = OrderedDict()
        self._accounts: OrderedDict[_Key, _Guesses] = OrderedDict()
        self._known: OrderedDict[_Key, None] = OrderedDict()

    def wait(self, account: str, address: str) -> float:
        """Return how long (s) this address must wait before its next try at this account, 0 for not at all."""
        now, pair = self._clock(), (account, network_of(address))
        guesses = self._pairs.get(pair)
        wait = 0.0
        if guesses is not None and now - guesses.last < _KEPT and guesses.wrong >= _FREE:
            # Bounded first: two to the power of a long attack is no number any more.
            doubled = 2.0 ** min(guesses.wrong - _FREE, 10.0)
            wait = guesses.last + min(doubled, _LONGEST_WAIT) - now
        if pair not in self._known:
            wrong = self._left(self._addresses, ("", pair[1]), _FORGOTTEN_OF_ADDRESS)
            wait = max(wait, (wrong - _FREE_OF_ADDRESS) / _FORGOTTEN_OF_ADDRESS)
        return max(wait, 0.0)

    def slowness(self, account: str, address: str) -> float:
        """Return by how much (s) a try at an account is held up that is being attacked from many addresses."""
        if (account, network_of(address)) in self._known:
            return 0.0
        wrong = self._left(self._accounts, (account, ""), _FORGOTTEN_OF_ACCOUNT)
        return SLOW if wrong >= _FREE_OF_ACCOUNT else 0.0

    def failed(self, account: str, address: str) -> None:
        """Note a wrong password."""
        now, network = self._clock(), network_of(address)
        pair = self._pairs.get((account, network))
        wrong = pair.wrong if pair is not None and now - pair.last < _KEPT else 0.0
        _keep(self._pairs, (account, network), _Guesses(wrong + 1.0, now))
        for table, key, forgotten in (
            (self._addresses, ("", network), _FORGOTTEN_OF_ADDRESS),
            (self._accounts, (account, ""), _FORGOTTEN_OF_ACCOUNT),
        ):
            _keep(table, key, _Guesses(self._left(table, key, forgotten) + 1.0, now))

    def succeeded(self, account: str, address: str) -> None:
        """Note a right password: this address is known to the account from now on."""
        pair = (account, network_of(address))
        self._pairs.pop(pair, None)
        _keep(self._known, pair, None)

    def entries(self) -> int:
        """Return how much is remembered."""
        return len(self._pairs) + len(self._addresses) + len(self._accounts) + len(self._known)

    def _left(self, table: OrderedDict[_Key, _Guesses], key: _Key, forgotten: float) -> float:
        """Return the wrong passwords that are not forgotten yet; `forgotten` of them each second."""
        guesses = table.get(key)
        return 0.0 if guesses is None else max(guesses.wrong - forgotten * (self._clock() - guesses.last), 0.0)


def network_of(address: str) -> str:
    """Return what one subscriber has: an IPv4 address, or the first 64 bits of an IPv6 address."""
    try:
        parsed = ip_address(address.partition("%")[0])
    except ValueError:
        return address[:64]
    if isinstance(parsed, IPv6Address):
        if parsed.ipv4_mapped is not None:
            return str(parsed.ipv4_mapped)
        return f"{IPv6Address(int(parsed) >> 64 << 64)}/64"
    return str(parsed)


def _keep(table: OrderedDict[_Key, _Value], key: _Key, value: _Value) -> None:
    table[key] = value
    table.move_to_end(key)
    if len(table) > _MOST:
        table.popitem(last=False)
