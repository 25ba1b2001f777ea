from bench.panel.server.throttle import SLOW, LoginThrottle, network_of

HERE = "192.0.2.1"
THERE = "198.51.100.7"


class Time:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def wrong(throttle: LoginThrottle, count: int, account: str = "anna", address: str = HERE) -> None:
    for _ in range(count):
        throttle.failed(account, address)


def test_the_wait_doubles_up_to_a_minute_and_passes() -> None:
    time = Time()
    throttle = LoginThrottle(time)
    waits = []
    for _ in range(13):
        time.now += 1e-6 + throttle.wait("anna", HERE)
        throttle.failed("anna", HERE)
        waits.append(round(throttle.wait("anna", HERE)))
    assert waits == [0, 0, 0, 0, 1, 2, 4, 8, 16, 32, 60, 60, 60]
    time.now += 900.0
    assert throttle.wait("anna", HERE) == 0.0


def test_wrong_passwords_count_for_their_account_and_address() -> None:
    throttle = LoginThrottle(Time())
    wrong(throttle, 25)
    assert throttle.wait("anna", HERE) > 10.0
    assert throttle.wait("bo", HERE) == 0.0
    assert throttle.wait("anna", THERE) == 0.0
    assert throttle.slowness("anna", THERE) == 0.0


def test_a_right_password_forgets_the_wrong_ones() -> None:
    throttle = LoginThrottle(Time())
    wrong(throttle, 4)
    throttle.succeeded("anna", HERE)
    wrong(throttle, 4)
    assert throttle.wait("anna", HERE) == 0.0


def test_an_address_that_tries_every_name_waits_for_all_but_those_it_logged_in_to() -> None:
    time = Time()
    throttle = LoginThrottle(time)
    throttle.succeeded("bo", HERE)
    for number in range(70):
        throttle.failed(f"name-{number}", HERE)
    assert 0.0 < throttle.wait("anna", HERE) <= 50.0
    assert throttle.wait("bo", HERE) == 0.0
    assert throttle.wait("anna", THERE) == 0.0
    time.now += throttle.wait("anna", HERE)
    assert throttle.wait("anna", HERE) == 0.0


def test_an_account_tried_from_everywhere_costs_a_new_address_little_and_a_known_one_nothing() -> None:
    throttle = LoginThrottle(Time())
    throttle.succeeded("anna", HERE)
    for number in range(1000):
        throttle.failed("anna", f"10.0.{number // 250}.{number % 250}")
    assert throttle.wait("anna", THERE) == 0.0
    assert throttle.slowness("anna", THERE) == SLOW
    assert throttle.slowness("anna", HERE) == 0.0
    assert throttle.slowness("bo", THERE) == 0.0


def test_memory_is_bounded() -> None:
    throttle = LoginThrottle(Time())
    for number in range(12_000):
        throttle.failed(f"name-{number}", f"10.{number >> 16}.{number >> 8 & 255}.{number & 255}")
    assert throttle.entries() <= 30_000


def test_what_one_subscriber_has_counts_as_one() -> None:
    assert network_of("2001:db8:1:2::5") == network_of("2001:db8:1:2:ffff::9") != network_of("2001:db8:1:3::5")
    assert network_of("::ffff:192.0.2.1") == network_of("192.0.2.1") != network_of("192.0.2.2")
