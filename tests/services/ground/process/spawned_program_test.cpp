#include "services/ground/process/spawned_program.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <string>
#include <thread>
#include <utility>

namespace weft {
namespace {

TEST(SpawnedProgram, SaysWhatItSaysIntoItsDescriptors) {
  const UniqueFd out = MemoryFile("out"), errors = MemoryFile("errors");
  SpawnedProgram program;
  ASSERT_EQ(program.Start({"sh", "-c", "echo said; echo wrong >&2; exit 3"}, {-1, out.get(), errors.get()}),
            0);
  const int status = program.Wait();
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 3);
  EXPECT_EQ(ContentOf(out), "said\n");
  EXPECT_EQ(ContentOf(errors), "wrong\n");
}

TEST(SpawnedProgram, TalksOverASocket) {
  UniqueFd ours, theirs;
  ASSERT_EQ(MakeSocketPair(ours, theirs), 0);
  SpawnedProgram program;
  ASSERT_EQ(program.Start({"sh", "-c", "printf abc"}, {-1, theirs.get()}), 0);
  theirs.Close();
  char said[3];
  EXPECT_EQ(ReceiveAll(ours, said, sizeof said), 0);
  EXPECT_EQ(std::string(said, sizeof said), "abc");
  EXPECT_EQ(ReceiveAll(ours, said, 1), EPIPE);
  program.Wait();
}

TEST(SpawnedProgram, IsLookedAtAndKilled) {
  SpawnedProgram program;
  ASSERT_EQ(program.Start({"sleep", "60"}, {-1, -1, -1}, true), 0);
  int status = 0;
  EXPECT_EQ(program.Poll(&status), 0);
  program.Kill();
  EXPECT_LT(program.Poll(&status), 0);
}

TEST(SpawnedProgram, SaysThatThereIsNoSuchProgram) {
  EXPECT_EQ(SpawnedProgram().Start({"/no/such/program"}, {-1}), ENOENT);
}

// What the shell says to this script.
std::string SaidBy(const std::string& script, bool has_own_group = false) {
  const UniqueFd out = MemoryFile("out");
  SpawnedProgram program;
  EXPECT_EQ(program.Start({"sh", "-c", script}, {-1, out.get(), -1}, has_own_group), 0);
  program.Wait();
  return ContentOf(out);
}

TEST(SpawnedProgram, HasNoOtherDescriptors) {
  const UniqueFd inherited(fcntl(STDERR_FILENO, F_DUPFD, 50));
  ASSERT_GE(inherited.get(), 50);
  EXPECT_EQ(SaidBy("ls /proc/$$/fd; :"), "0\n1\n2\n");
  EXPECT_EQ(SaidBy("readlink /proc/$$/fd/0 /proc/$$/fd/2; cat; echo x >&2"), "/dev/null\n/dev/null\n");
}

TEST(SpawnedProgram, IsOfOurGroupUnlessItHasItsOwn) {
  const std::string script = "read pid name state parent group rest < /proc/$$/stat; echo $pid $group";
  const std::string shared = SaidBy(script), own = SaidBy(script, true);
  EXPECT_EQ(shared.substr(shared.find(' ')), " " + std::to_string(getpgrp()) + "\n");
  const std::string pid = own.substr(0, own.find(' '));
  EXPECT_EQ(own, pid + " " + pid + "\n");
}

TEST(SpawnedProgram, TellsItsEndOnce) {
  SpawnedProgram program;
  int status = 0;
  EXPECT_EQ(program.Poll(&status), -1) << "it was never started";
  EXPECT_EQ(program.Wait(), 0);
  ASSERT_EQ(program.Start({"sh", "-c", "exit 5"}, {-1}), 0);
  int ended = 0;
  while ((ended = program.Poll(&status)) == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_GT(ended, 0);
  EXPECT_EQ(WEXITSTATUS(status), 5);
  EXPECT_EQ(program.Poll(&status), -1);
  EXPECT_EQ(program.Wait(), 0);
}

TEST(SpawnedProgram, GoesWithWhatItIsMovedTo) {
  SpawnedProgram first;
  ASSERT_EQ(first.Start({"sleep", "60"}, {-1}), 0);
  SpawnedProgram second(std::move(first));
  int status = 0;
  EXPECT_EQ(second.Poll(&status), 0);
  first.Kill();
  EXPECT_EQ(second.Poll(&status), 0) << "it is not the first one's any more";
  EXPECT_EQ(first.Poll(&status), -1);
}

TEST(SpawnedProgram, IsKilledWithItsOwner) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  UniqueFd read_end(ends[0]), write_end(ends[1]);
  {
    SpawnedProgram program;
    ASSERT_EQ(program.Start({"sleep", "60"}, {-1, write_end.get()}), 0);
    write_end.Close();
  }
  char byte = 0;
  EXPECT_EQ(read(read_end.get(), &byte, 1), 0) << "nobody holds the other end";
}

TEST(SpawnedProgram, DescriptorsAreAboveThoseOfPrograms) {
  const UniqueFd file = MemoryFile("file");
  EXPECT_GE(file.get(), 10);
  EXPECT_EQ(fcntl(file.get(), F_GETFD), FD_CLOEXEC);
  UniqueFd ours, theirs;
  ASSERT_EQ(MakeSocketPair(ours, theirs), 0);
  EXPECT_TRUE(ours.open());
  EXPECT_GE(theirs.get(), 10);
  EXPECT_EQ(SizeOf(UniqueFd()), 0u);
  EXPECT_EQ(ContentOf(UniqueFd()), "");
}

TEST(ReceiveAll, WaitsForAllOrForSoLong) {
  UniqueFd ours, theirs;
  ASSERT_EQ(MakeSocketPair(ours, theirs), 0);
  char said[4] = "...";
  EXPECT_EQ(ReceiveAll(ours, said, 3, 1), ETIMEDOUT);
  ASSERT_EQ(write(theirs.get(), "ab", 2), 2);
  EXPECT_EQ(ReceiveAll(ours, said, 3, 1), ETIMEDOUT) << "one is missing";
  std::thread writer([&] {
    for (const char* piece : {"x", "y", "z"}) {
      EXPECT_EQ(write(theirs.get(), piece, 1), 1);
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  });
  EXPECT_EQ(ReceiveAll(ours, said, 3), 0);
  writer.join();
  EXPECT_STREQ(said, "xyz");
  EXPECT_EQ(ReceiveAll(ours, said, 0, 0), 0);
}

}  // namespace
}  // namespace weft
