#include "services/ground/process/spawned_program.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cerrno>

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
  EXPECT_EQ(program.Look(&status), 0);
  program.Kill();
  EXPECT_LT(program.Look(&status), 0);
}

TEST(SpawnedProgram, SaysThatThereIsNoSuchProgram) {
  EXPECT_EQ(SpawnedProgram().Start({"/no/such/program"}, {-1}), ENOENT);
}

}  // namespace
}  // namespace weft
