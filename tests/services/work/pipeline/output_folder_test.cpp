#include "services/work/pipeline/output_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::HasSubstr;

absl::Status CheckOut(const std::string& dump, const std::string& out) {
  v1::RegistrationSpec spec;
  spec.set_dump(dump);
  spec.set_out(out);
  return CheckOutOfInputs(spec);
}

TEST(OutputFolder, ResultsStayOutOfWhatIsRead) {
  const TempFolder folder;
  std::filesystem::create_directories(folder / "takes/take");
  const std::string dump = folder / "takes/take";
  EXPECT_TRUE(CheckOut(dump, folder / "results").ok());
  EXPECT_TRUE(CheckOut(dump, folder / "takes/take2").ok());
  EXPECT_THAT(std::string(CheckOut(dump, folder / "takes/take/out").message()),
              HasSubstr("lies in the folder of"));
  EXPECT_THAT(std::string(CheckOut(dump, dump + "/").message()), HasSubstr("lies in the folder of"));
  EXPECT_THAT(std::string(CheckOut(dump, folder / "takes").message()), HasSubstr("contains"));
}

TEST(OutputFolder, LinksDoNotHideAnInput) {
  const TempFolder folder;
  std::filesystem::create_directory(folder / "take");
  std::filesystem::create_directory_symlink(folder / "take", folder / "link");
  EXPECT_THAT(std::string(CheckOut(folder / "take", folder / "link/out").message()),
              HasSubstr("lies in the folder of"));
}

TEST(OutputFolder, IsMadeAndNamedWithoutLinks) {
  const TempFolder folder;
  std::filesystem::create_directory(folder / "real");
  std::filesystem::create_directory_symlink(folder / "real", folder / "link");
  const auto made = MakeOutputFolder(folder / "link/a/b");
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(*made, std::filesystem::canonical(folder / "real").string() + "/a/b");
  EXPECT_TRUE(std::filesystem::is_directory(folder / "real/a/b"));
}

}  // namespace
}  // namespace weft
