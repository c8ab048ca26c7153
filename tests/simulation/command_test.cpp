// `weft simulate` and `weft evaluate` as a user runs them.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdio>
#include <string>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

struct Outcome {
  int status = -1;
  std::string text;  // stdout and stderr
};

Outcome Weft(const std::string& arguments) {
  Outcome out;
  FILE* pipe = popen(("\"" WEFT_BINARY "\" " + arguments + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return out;
  char buffer[4096];
  for (size_t n = 0; (n = fread(buffer, 1, sizeof(buffer), pipe)) > 0;) out.text.append(buffer, n);
  out.status = WEXITSTATUS(pclose(pipe));
  return out;
}

std::string Quoted(const std::string& path) { return "\"" + path + "\""; }

TEST(SimulateCommand, WritesATakeThatEvaluatesAgainstItself) {
  const TempFolder folder;
  const Outcome made =
      Weft("simulate --preset tiny --frames 1 --seed 5 --threads 1 --out " + Quoted(folder / "take"));
  ASSERT_EQ(made.status, 0) << made.text;
  EXPECT_NE(made.text.find("1 frames, 12 cameras, 1152 cells"), std::string::npos) << made.text;

  // The truth's own mesh is a job's result without error.
  std::filesystem::create_directories(folder / "result/0000");
  std::filesystem::copy(folder / "take/truth/0000/mesh.ply", folder / "result/0000/mesh.ply");
  const std::string arguments = Quoted(folder / "result") + " --truth " + Quoted(folder / "take/truth");
  const Outcome table = Weft("evaluate " + arguments);
  EXPECT_EQ(table.status, 0) << table.text;
  EXPECT_NE(table.text.find("no cloud.ply"), std::string::npos) << table.text;
  const Outcome json = Weft("evaluate --json " + arguments);
  EXPECT_EQ(json.status, 0) << json.text;
  EXPECT_EQ(json.text.front(), '{');

  const Outcome again = Weft("simulate --preset tiny --out " + Quoted(folder / "take"));
  EXPECT_EQ(again.status, 2);
  EXPECT_NE(again.text.find("exists"), std::string::npos) << again.text;
}

TEST(SimulateCommand, BadArgumentsEndWithStatus2) {
  const TempFolder folder;
  const Outcome preset = Weft("simulate --preset huge --out " + Quoted(folder / "take"));
  EXPECT_EQ(preset.status, 2);
  EXPECT_NE(preset.text.find("tiny, quickstart"), std::string::npos) << preset.text;
  EXPECT_EQ(Weft("simulate --preset tiny").status, 2);
  EXPECT_EQ(Weft("simulate --preset tiny --frames -1 --out " + Quoted(folder / "take")).status, 2);
}

TEST(EvaluateCommand, FoldersWithoutTruthOrResultEndWithStatus2) {
  const TempFolder folder;
  const Outcome outcome = Weft("evaluate " + Quoted(folder.path()) + " --truth " + Quoted(folder.path()));
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.text.find("weft simulate"), std::string::npos) << outcome.text;
}

}  // namespace
}  // namespace weft
