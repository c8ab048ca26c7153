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

TEST(OutputFolder, RefusalsSayWhatToChoose) {
  const TempFolder folder;
  std::filesystem::create_directories(folder / "takes/take");
  WriteBytes(folder / "inputs/rig.json", "{}");
  const std::string dump = folder / "takes/take";
  EXPECT_EQ(CheckOut(dump, dump + "/out"),
            absl::InvalidArgumentError("out: " + dump + "/out lies in the folder of the take, " + dump +
                                       ", which is only read; choose a folder outside of it"));
  EXPECT_EQ(CheckOut(dump, folder / "takes"),
            absl::InvalidArgumentError("out: " + (folder / "takes") + " contains the take, " + dump +
                                       ", which is only read; choose another folder"));
  v1::RegistrationSpec spec;
  spec.set_rig(folder / "inputs/rig.json");
  spec.set_out(folder / "inputs");
  EXPECT_EQ(CheckOutOfInputs(spec),
            absl::InvalidArgumentError("out: " + (folder / "inputs") + " contains the rig, " + spec.rig() +
                                       ", which is only read; choose another folder"));
  spec.set_out(folder / "inputs/rig.json");
  EXPECT_FALSE(CheckOutOfInputs(spec).ok());
  spec.set_out(folder / "inputs/rig.json/out");
  EXPECT_TRUE(CheckOutOfInputs(spec).ok()) << "a file is no folder";
  // What is not there yet is looked at by its name.
  EXPECT_FALSE(CheckOut(folder / "none/take", folder / "none/../none").ok());
  EXPECT_TRUE(CheckOut(folder / "none", folder / "none/take").ok());
  EXPECT_TRUE(CheckOut("", folder / "none").ok());
}

TEST(OutputFolder, CannotBeMadeInAFile) {
  const TempFolder folder;
  WriteBytes(folder / "file", "x");
  EXPECT_FALSE(MakeOutputFolder(folder / "file/out").ok());
}

}  // namespace
}  // namespace weft
