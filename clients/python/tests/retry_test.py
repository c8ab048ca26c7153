"""What is repeated, and when: against a gRPC server of this process that refuses as a daemon does."""

import contextlib
import multiprocessing
import os
import tempfile
import time
import unittest
from concurrent import futures
from dataclasses import dataclass

import grpc

import weft
from weft.errors import retry_after_s
from weft.retry import Backoff, may_be_repeated
from weft.v1 import jobs_pb2_grpc, server_pb2_grpc, takes_pb2_grpc

QUICK = weft.RetryPolicy(first_pause_s=0.01, longest_pause_s=0.05, patience_s=5)


@dataclass
class Refusal:
    code: grpc.StatusCode
    message: str = "refused"
    metadata: tuple = ()


class Refusals:
    """Refuses calls as told, then answers."""

    def __init__(self, *refusals):
        self.refusals, self.requests, self.times = list(refusals), [], []

    def answer(self, request, context, answer):
        self.requests.append(request)
        self.times.append(time.monotonic())
        if self.refusals:
            refusal = self.refusals.pop(0)
            context.set_trailing_metadata(refusal.metadata)
            context.abort(refusal.code, refusal.message)
        return answer


class Server(server_pb2_grpc.ServerServicer, Refusals):
    def GetServerInfo(self, request, context):
        return self.answer(request, context, weft.v1.ServerInfo(version="7"))


class Jobs(jobs_pb2_grpc.JobsServicer, Refusals):
    def SubmitJob(self, request, context):
        return self.answer(request, context, weft.v1.Job(id=request.idempotency_key))

    def RetryJob(self, request, context):
        return self.answer(request, context, weft.v1.Job())

    def WatchJob(self, request, context):
        self.answer(request, context, None)
        for state in (weft.v1.JOB_STATE_RUNNING, weft.v1.JOB_STATE_DONE):
            yield weft.v1.JobUpdate(job=weft.v1.Job(state=state))


class Takes(takes_pb2_grpc.TakesServicer):
    """Tells the newest events with every new watch, as a daemon does, and breaks off after each message but the last."""

    def __init__(self, *messages):
        self.messages = list(messages)

    def WatchTake(self, request, context):
        yield weft.v1.RecordedTake(events=[weft.v1.TakeEvent(event=event) for event in self.messages.pop(0)])
        if self.messages:
            context.abort(grpc.StatusCode.UNAVAILABLE, "gone")


@contextlib.contextmanager
def client_of(service, **options):
    with tempfile.TemporaryDirectory(prefix="weft-retry-") as folder:
        server = grpc.server(futures.ThreadPoolExecutor(4))
        adders = {Server: server_pb2_grpc.add_ServerServicer_to_server, Jobs: jobs_pb2_grpc.add_JobsServicer_to_server,
                  Takes: takes_pb2_grpc.add_TakesServicer_to_server}
        adders[type(service)](service, server)
        address = f"unix:{folder}/socket"
        server.add_insecure_port(address)
        server.start()
        try:
            with weft.Client(address, identity=weft.Identity(), **{"calling": QUICK, "watching": QUICK, **options}) as client:
                yield client
        finally:
            server.stop(None).wait()


UNAVAILABLE = Refusal(grpc.StatusCode.UNAVAILABLE)
FULL = Refusal(grpc.StatusCode.RESOURCE_EXHAUSTED)
# As a daemon says it, and by trailing metadata.
BUSY = [Refusal(one.code, "24 calls run; retry after 200 ms") for one in (FULL, UNAVAILABLE)]
BUSY += [Refusal(FULL.code, metadata=((key, "200"),)) for key in ("retry-after-ms", "grpc-retry-pushback-ms")]


class Calls(unittest.TestCase):
    def test_that_read_are_repeated_while_no_daemon_answers(self):
        service = Server(UNAVAILABLE, UNAVAILABLE)
        with client_of(service) as client:
            self.assertEqual(client.server_info().version, "7")
        self.assertEqual(len(service.requests), 3)

    def test_wait_as_long_as_the_daemon_says(self):
        for refusal in BUSY:
            service = Server(refusal)
            with client_of(service) as client:
                client.server_info()
            self.assertGreaterEqual(service.times[1] - service.times[0], 0.2)

    def test_that_would_wait_too_long_end_with_the_time(self):
        service = Server(Refusal(grpc.StatusCode.RESOURCE_EXHAUSTED, "come tomorrow; retry after 3600000 ms"))
        with client_of(service) as client, self.assertRaises(weft.ResourceExhausted) as caught:
            client.server_info()
        self.assertEqual((len(service.requests), caught.exception.retry_after_s), (1, 3600))

    def test_that_a_full_disk_or_a_final_no_refused_are_not_repeated(self):
        never = (("grpc-retry-pushback-ms", "-1"),)
        for refusal in (FULL, Refusal(FULL.code, metadata=never), Refusal(UNAVAILABLE.code, metadata=never),
                        Refusal(grpc.StatusCode.INTERNAL), Refusal(grpc.StatusCode.DEADLINE_EXCEEDED),
                        Refusal(grpc.StatusCode.NOT_FOUND), Refusal(grpc.StatusCode.ABORTED, "no; retry after 10 ms")):
            service = Server(refusal)
            with client_of(service) as client, self.assertRaises(weft.WeftError):
                client.server_info()
            self.assertEqual(len(service.requests), 1, refusal)

    def test_that_may_have_happened_are_repeated_only_with_one_key(self):
        service = Jobs(UNAVAILABLE, UNAVAILABLE)
        with client_of(service) as client:
            job = client.jobs.submit(weft.v1.RegistrationSpec())
        self.assertEqual([request.idempotency_key for request in service.requests], [job.id] * 3)
        self.assertRegex(job.id, "^[a-z0-9-]{8,64}$")
        service = Jobs(UNAVAILABLE)
        with client_of(service) as client, self.assertRaises(weft.Unavailable):
            client.jobs.retry("job")
        self.assertEqual(len(service.requests), 1)
        service = Jobs(*BUSY)  # surely not done, since the daemon says when to come back
        with client_of(service) as client:
            client.jobs.retry("job")
        self.assertEqual(len(service.requests), 1 + len(BUSY))

    def test_give_up_after_their_patience(self):
        service = Server(*[UNAVAILABLE] * 1000)
        policy = weft.RetryPolicy(first_pause_s=0.01, longest_pause_s=0.01, jitter=0, patience_s=0.095)
        with client_of(service, calling=policy) as client, self.assertRaisesRegex(weft.Unavailable, "no daemon answers at unix:"):
            client.server_info()
        self.assertEqual(len(service.requests), 10)

    def test_of_a_process_that_was_forked_say_so(self):
        with client_of(Server()) as client:
            receiver, sender = multiprocessing.Pipe(duplex=False)
            if (child := os.fork()) == 0:
                try:
                    client.server_info()
                except weft.FailedPrecondition as error:
                    sender.send(str(error))
                finally:
                    os._exit(0)
            os.waitpid(child, 0)
            self.assertTrue(receiver.poll())
            self.assertIn("os.fork()", receiver.recv())


class Watches(unittest.TestCase):
    def test_go_on_after_what_may_pass(self):
        service = Jobs(UNAVAILABLE, BUSY[0], Refusal(grpc.StatusCode.CANCELLED))
        with client_of(service) as client:
            states = [update.job.state for update in client.jobs.watch("job")]
        self.assertEqual(states, [weft.v1.JOB_STATE_RUNNING, weft.v1.JOB_STATE_DONE])
        self.assertEqual(len(service.requests), 4)

    def test_of_takes_tell_every_event_once(self):
        with client_of(Takes("ab", "abc", "abc", "abcde")) as client:
            told = [[event.event for event in take.events] for take in client.takes.watch("take")]
        self.assertEqual(told, [["a", "b"], ["c"], [], ["d", "e"]])

    def test_end_with_other_errors_and_stay_ended(self):
        with client_of(Jobs(Refusal(grpc.StatusCode.NOT_FOUND))) as client:
            watch = client.jobs.watch("job")
            with self.assertRaises(weft.NotFound):
                next(watch)
            self.assertEqual(list(watch), [])

    def test_end_when_they_are_closed(self):
        with client_of(Jobs()) as client:
            with client.jobs.watch("job") as watch:
                next(watch)
            self.assertEqual(list(watch), [])


class Pauses(unittest.TestCase):
    def test_grow_to_the_longest_and_shrink_by_the_jitter(self):
        policy = weft.RetryPolicy(first_pause_s=1, factor=2, longest_pause_s=5, jitter=0.5, patience_s=100)
        error = weft.Unavailable("")
        for uniform, expected in ((lambda: 0.0, [1, 2, 4, 5, 5]), (lambda: 1.0, [0.5, 1, 2, 2.5, 2.5])):
            backoff = Backoff(policy, uniform)
            self.assertEqual([backoff.pause_s(error) for _ in expected], expected)
            backoff.reset()
            self.assertEqual(backoff.pause_s(error), expected[0])

    def test_are_never_shorter_than_asked_for(self):
        for share in (0.0, 1.0):
            backoff = Backoff(weft.RetryPolicy(busy_patience_s=1000, jitter=0.5), lambda share=share: share)
            for seconds in (7.0, 0.5, 60.0):
                pause_s = backoff.pause_s(weft.ResourceExhausted("", retry_after_s=seconds))
                self.assertGreaterEqual(pause_s, seconds)
                self.assertLess(pause_s, 1.5 * seconds + 1)

    def test_end_with_the_patience(self):
        backoff = Backoff(weft.RetryPolicy(first_pause_s=1, factor=1, longest_pause_s=1, jitter=0, patience_s=3))
        self.assertEqual([backoff.pause_s(weft.Unavailable("")) for _ in range(5)], [1, 1, 1, None, None])

    def test_of_policies_that_make_no_sense_are_refused(self):
        wrongs = ({"first_pause_s": 0}, {"factor": 0.5}, {"jitter": 2}, {"patience_s": -1}, {"busy_patience_s": -1},
                  {"longest_pause_s": 0.1})
        for wrong in wrongs:
            with self.assertRaises(ValueError, msg=wrong):
                weft.RetryPolicy(**wrong)

    def test_are_read_from_words_and_metadata(self):
        for text, expected in (("250", 0.25), ("0", 0), ("-1", -1), ("soon", -1), ("1e3", -1), (b"40", 0.04)):
            self.assertEqual(retry_after_s("busy", [("other", "1"), ("retry-after-ms", text)]), expected)
        for words, expected in (("busy; retry after 40 ms", 0.04), ("busy; retry after 40 ms, perhaps", None), ("busy", None),
                                ("busy; retry after -4 ms", None)):
            self.assertEqual(retry_after_s(words, [("other", "1")]), expected)

    def test_follow_the_category(self):
        self.assertTrue(may_be_repeated(weft.Unavailable(""), harmless=True))
        self.assertFalse(may_be_repeated(weft.Unavailable(""), harmless=False))
        self.assertFalse(may_be_repeated(weft.DeadlineExceeded(""), harmless=True))
        self.assertFalse(may_be_repeated(weft.ResourceExhausted(""), harmless=True))
        for error in (weft.ResourceExhausted, weft.Unavailable):
            self.assertTrue(may_be_repeated(error("", retry_after_s=1), harmless=False))
            self.assertFalse(may_be_repeated(error("", retry_after_s=-1), harmless=True))


if __name__ == "__main__":
    unittest.main()
