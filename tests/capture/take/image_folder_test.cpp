#include "capture/take/image_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "capture/image/image_file.h"
#include "capture/take/picture_sizes.h"
#include "tests/capture/temp_folder.h"

namespace weft {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;

constexpr char kInRig[] = "Kam\xc3\xa9ra", kOnMac[] = "Kame\xcc\x81ra";

void WritePicture(const std::string& path, int width_px = 16, int height_px = 12) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  Frame frame;
  frame.width_px = width_px;
  frame.height_px = height_px;
  frame.pixels = std::make_shared<const std::vector<uint8_t>>(width_px * height_px, uint8_t{7});
  const std::string ending = std::filesystem::path(path).extension().string();
  ASSERT_TRUE(WriteImageFile(path, frame).ok());
}

Rig RigOf(const std::vector<std::string>& ids, int width_px = 16, int height_px = 12) {
  Rig rig;
  for (const std::string& id : ids) {
    CameraModel camera;
    camera.id = id;
    camera.width_px = width_px;
    camera.height_px = height_px;
    rig.cameras.push_back(camera);
  }
  return rig;
}

// "frame/camera" of all pictures.
std::vector<std::string> Listed(const ImageFolder& listing) {
  std::vector<std::string> all;
  for (const auto& [frame, cameras] : listing.frames)
    for (const auto& [camera, path] : cameras) all.push_back(frame + "/" + camera);
  return all;
}

TEST(ImageFolder, LeavesOutWhatOtherProgramsPutThere) {
  const TempFolder dump;
  for (const char* camera : {"c00", "c01"}) WritePicture(dump / ("0000/" + std::string(camera) + ".png"));
  WriteBytes(dump / "0000/._c00.png", "Mac OS X");
  WriteBytes(dump / "0000/Thumbs.db", "");
  WriteBytes(dump / "0000/.DS_Store", "");
  for (const char* folder : {"@eaDir", ".thumbnails", "#recycle", "__MACOSX", "$RECYCLE.BIN"})
    WritePicture(dump / (std::string(folder) + "/c00.png"), 4, 3);
  WritePicture(dump / "@eaDir/c01.jpg/SYNOPHOTO_THUMB_M.jpg", 4, 3);
  std::filesystem::create_directories(dump / "lost+found");
  std::filesystem::create_directories(dump / "0001");
  const auto listing = ListImageFolder(dump.path());
  ASSERT_TRUE(listing.ok()) << listing.status();
  EXPECT_THAT(Listed(*listing), ElementsAre("0000/c00", "0000/c01"));
  EXPECT_THAT(listing->notes,
              ElementsAre("1 hidden file is left out: ._c00.png",
                          "pictures in folders of other programs are left out: #recycle, $RECYCLE.BIN, "
                          ".thumbnails, @eaDir, __MACOSX",
                          "empty folders are no frames: 0001"));
}

TEST(ImageFolder, SaysNothingOfAnOrdinaryDump) {
  const TempFolder dump;
  for (const char* frame : {"0000", "0001"})
    for (const char* camera : {"c00", "c01"})
      WritePicture(dump / (std::string(frame) + "/" + camera + ".png"));
  std::filesystem::create_directories(dump / "truth/0000");
  EXPECT_THAT(ListImageFolder(dump.path())->notes, IsEmpty());
  const Rig rig = RigOf({"c00", "c01"});
  EXPECT_THAT(ListImageFolder(dump.path(), &rig)->notes, IsEmpty());
}

TEST(ImageFolder, ReadsAFolderPerCameraWhereNamesTell) {
  const TempFolder dump;
  for (const char* camera : {"c00", "c01", "c02"})
    for (const char* frame : {"0000", "0001"})
      WritePicture(dump / (std::string(camera) + "/" + frame + ".png"));
  const Rig rig = RigOf({"c00", "c01", "c02", "c03"});
  for (const Rig* given : {static_cast<const Rig*>(nullptr), &rig}) {
    const auto listing = ListImageFolder(dump.path(), given);
    ASSERT_TRUE(listing.ok()) << listing.status();
    EXPECT_THAT(Listed(*listing),
                ElementsAre("0000/c00", "0000/c01", "0000/c02", "0001/c00", "0001/c01", "0001/c02"));
    EXPECT_THAT(listing->notes, ElementsAre(HasSubstr("read as <camera>/<frame>, since the folders")));
  }
}

TEST(ImageFolder, SizesTellWhereNamesDoNot) {
  const struct {
    bool folders_differ;
    std::vector<std::string> listed;
  } kDumps[] = {{true, {"0/0", "0/1", "1/0", "1/1", "2/0", "2/1"}},
                {false, {"0/0", "0/1", "0/2", "1/0", "1/1", "1/2"}}};
  for (const auto& [folders_differ, listed] : kDumps) {
    const TempFolder dump;
    for (int folder = 0; folder < 2; ++folder)
      for (int file = 0; file < 3; ++file)
        WritePicture(dump / (std::to_string(folder) + "/" + std::to_string(file) + ".png"),
                     16 + (folders_differ ? folder : file));
    EXPECT_EQ(Listed(*ListImageFolder(dump.path())), listed);
  }
  const TempFolder dump;
  for (const char* path : {"0/0.png", "0/1.png", "1/0.png"}) WritePicture(dump / path);
  EXPECT_THAT(
      ListImageFolder(dump.path())->notes,
      ElementsAre(HasSubstr("fit frames and cameras alike; if they are <camera>/<frame>, name them cam")));
}

TEST(ImageFolder, ReadsWhatDoesNotStartWithImageInFoldersOfCameras) {
  const TempFolder dump;
  for (const char* camera : {"cam0", "cam1"})
    for (const char* frame : {"0000", "0001"})
      WritePicture(dump / (std::string(camera) + "/" + frame + ".png"));
  EXPECT_THAT(Listed(*ListImageFolder(dump.path())),
              ElementsAre("0000/cam0", "0000/cam1", "0001/cam0", "0001/cam1"));
}

TEST(ImageFolder, FoldersOfCamerasMayHaveCamBeforeTheRigsNames) {
  const TempFolder dump;
  for (const char* path : {"cam1/0000.png", "Cam_2/0000.png"}) WritePicture(dump / path);
  const Rig rig = RigOf({"1", "2"});
  const auto listing = ListImageFolder(dump.path(), &rig);
  ASSERT_TRUE(listing.ok()) << listing.status();
  EXPECT_THAT(Listed(*listing), ElementsAre("0000/1", "0000/2"));
}

TEST(ImageFolder, NamesAreComparedAsUnicodeDoes) {
  const TempFolder dump;
  WritePicture(dump / ("0000/" + std::string(kOnMac) + ".png"));
  WritePicture(dump / "0000/C01.PNG");
  for (const char* id : {kInRig, kOnMac}) {
    const Rig rig = RigOf({id, "c01"});
    const auto listing = ListImageFolder(dump.path(), &rig);
    ASSERT_TRUE(listing.ok()) << listing.status();
    EXPECT_THAT(listing->frames.at("0000"),
                UnorderedElementsAre(Pair("c01", HasSubstr("C01.PNG")), Pair(id, HasSubstr(kOnMac))));
    EXPECT_THAT(listing->notes, ElementsAre(HasSubstr("1 name is decomposed as macOS writes it")));
  }
  EXPECT_THAT(Listed(*ListImageFolder(dump.path())), ElementsAre("0000/C01", "0000/" + std::string(kInRig)));
}

TEST(ImageFolder, NumbersThatDifferInZerosAreOneFrame) {
  const TempFolder dump;
  for (const char* path : {"cam0/image0.png", "cam0/image1.png", "cam1/image0000.png", "cam1/image0001.png"})
    WritePicture(dump / path);
  const auto listing = ListImageFolder(dump.path());
  EXPECT_THAT(Listed(*listing), ElementsAre("0000/0", "0000/1", "0001/0", "0001/1"));
  EXPECT_THAT(listing->notes,
              ElementsAre("frames whose numbers differ in zeros alone are taken as one: 0 and "
                          "0000, 1 and 0001"));
  WritePicture(dump / "cam0/image01.png");
  const auto apart = ListImageFolder(dump.path());
  EXPECT_THAT(Listed(*apart), ElementsAre("0000/0", "0000/1", "0001/1", "01/0", "1/0"));
  EXPECT_THAT(apart->notes,
              ElementsAre(HasSubstr("taken as one: 0 and 0000"),
                          HasSubstr("kept apart although their numbers differ in zeros alone")));
}

TEST(ImageFolder, TakesThePictureOfSeveralFilesOfACamera) {
  const TempFolder dump;
  WritePicture(dump / "0000/c00.png", 64, 48);
  WritePicture(dump / "0000/c00.tif", 16, 12);
  WriteBytes(dump / "0000/c00.jpg", "damaged");
  const Rig small = RigOf({"c00"}), large = RigOf({"c00"}, 64, 48);
  EXPECT_THAT(ListImageFolder(dump.path(), &small)->frames.at("0000").at("c00"), HasSubstr("c00.tif"));
  EXPECT_THAT(ListImageFolder(dump.path(), &large)->frames.at("0000").at("c00"), HasSubstr("c00.png"));
  const auto without = ListImageFolder(dump.path());
  EXPECT_THAT(without->frames.at("0000").at("c00"), HasSubstr("c00.png"));
  EXPECT_THAT(without->notes,
              ElementsAre("of several files of one camera in a frame, the largest picture is taken; "
                          "left out: 0000/c00.jpg, 0000/c00.tif"));
}

TEST(ImageFolder, RefusesTwoPicturesOfACameraThatAreAlike) {
  const TempFolder dump;
  for (const char* name : {"0000/c00.png", "0000/c00.tif"}) WritePicture(dump / name);
  const Rig rig = RigOf({"c00"});
  for (const Rig* given : {static_cast<const Rig*>(nullptr), &rig}) {
    const absl::Status status = ListImageFolder(dump.path(), given).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(
        std::string(status.message()),
        HasSubstr(
            "/0000: two pictures of one camera, c00.png of 16x12 and c00.tif of 16x12 pixels; keep one"));
  }
  const Rig other = RigOf({"c07"});  // whose pictures are not looked at
  EXPECT_TRUE(ListImageFolder(dump.path(), &other).ok());
}

TEST(ImageFolder, NamesPicturesThatAreNotRead) {
  const TempFolder dump;
  for (const char* name : {"0000/c00.png", "0001/c00.png"}) WritePicture(dump / name);
  for (const char* name :
       {"0000/c01.bmp", "0001/c01.BMP", "0001/c02.png.tmp", "0001/notes.txt", "0001/._c03.bmp"})
    WriteBytes(dump / name, "x");
  EXPECT_THAT(ListImageFolder(dump.path())->notes,
              ElementsAre(AllOf(HasSubstr("3 pictures are not read"), HasSubstr("0000/c01.bmp"))));
}

TEST(ImageFolder, FoldersWithoutANumberAmongNumberedOnesAreNoFrames) {
  const TempFolder dump;
  for (const char* name : {"0000/c00.png", "0001/c00.png", "masks/c00.png", "calib/c00.png"})
    WritePicture(dump / name);
  const auto listing = ListImageFolder(dump.path());
  EXPECT_THAT(Listed(*listing), ElementsAre("0000/c00", "0001/c00"));
  EXPECT_THAT(listing->notes, ElementsAre(HasSubstr("left out: calib, masks")));
  // One number, or none, says nothing.
  std::filesystem::remove_all(dump / "0001");
  EXPECT_EQ(ListImageFolder(dump.path())->frames.size(), 3u);
}

TEST(ImageFolder, NamesWhereLoosePicturesLie) {
  const TempFolder dump;
  WritePicture(dump / "c00.png");
  const auto listing = ListImageFolder(dump.path());
  EXPECT_THAT(listing->frames, IsEmpty());
  EXPECT_THAT(listing->notes, ElementsAre(HasSubstr("lie in the folder itself (c00.png)")));
}

TEST(ImageFolder, SaysThatPicturesAreNotTurned) {
  const TempFolder dump;
  WritePicture(dump / "0000/c00.png");
  const std::string png = ReadBytes(dump / "0000/c00.png");
  // A chunk eXIf behind the header: orientation 6. Its checksum is not looked at here.
  const std::string exif(
      "\0\0\0\x1a"
      "eXIfMM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0....",
      38);
  WriteBytes(dump / "0000/c00.png", png.substr(0, 33) + exif + png.substr(33));
  EXPECT_THAT(ListImageFolder(dump.path())->notes,
              ElementsAre(HasSubstr(
                  "pictures of c00 say that they are to be shown rotated by 90 degrees clockwise")));
}

TEST(ImageFolder, LeavesOutCopiesBesideTheirOriginals) {
  const TempFolder temp;
  for (const char* name :
       {"0000/c00", "0000/c00 (1)", "0000/c01", "0001/c00", "0001/c01", "0001/c01 - Copy", "0001 (1)/c00"})
    WritePicture(temp / (std::string(name) + ".png"));
  const auto listing = ListImageFolder(temp.path());
  ASSERT_TRUE(listing.ok()) << listing.status();
  EXPECT_THAT(Listed(*listing), ElementsAre("0000/c00", "0000/c01", "0001/c00", "0001/c01"));
  EXPECT_THAT(listing->notes, ElementsAre(HasSubstr("3 pictures are copies by the name, beside the original, "
                                                    "and left out: ")));
}

TEST(ImageFolder, NamesMayRepeatThatOfTheirFolder) {
  const TempFolder temp;
  for (const char* name : {"c00/c00_0007", "c00/c00_0008", "c01/c01_0007", "c01/c01_0008"})
    WritePicture(temp / "cameras" + ("/" + std::string(name) + ".png"));
  for (const char* name : {"0007/c00-0007", "0008/c00-0008", "0007/c01-0007", "0008/c01-0008"})
    WritePicture(temp / "frames" + ("/" + std::string(name) + ".png"));
  for (const char* dump : {"cameras", "frames"}) {
    const auto listing = ListImageFolder(temp / dump);
    ASSERT_TRUE(listing.ok()) << listing.status();
    EXPECT_THAT(Listed(*listing), ElementsAre("0007/c00", "0007/c01", "0008/c00", "0008/c01")) << dump;
  }
  const Rig rig = RigOf({"c00-0007", "c01-0007"});
  const auto listing = ListImageFolder(temp / "frames", &rig);
  ASSERT_TRUE(listing.ok()) << listing.status();
  EXPECT_THAT(Listed(*listing), testing::Contains("0007/c00-0007"));
}

TEST(ImageFolder, SizesOfOneAmongManyAreOdd) {
  const TempFolder temp;
  for (int frame = 0; frame < 5; ++frame) {
    const std::string folder = temp / ("000" + std::to_string(frame));
    WritePicture(folder + "/c00.png", 16, 12);
    WritePicture(folder + "/c01.png", frame == 3 ? 12 : 16, frame == 3 ? 16 : 12);
    WritePicture(folder + "/c02.png", 32, 24);
  }
  const auto odd = FindOddPictures(*ListImageFolder(temp.path()));
  ASSERT_TRUE(odd.ok()) << odd.status();
  EXPECT_THAT(odd->notes, ElementsAre("camera c01: its pictures are 16x12 pixels, and those of another size "
                                      "are missing: 12x16 (0003)"));
  EXPECT_THAT(odd->why,
              ElementsAre(Pair(temp / "0003/c01.png", "is 12x16 pixels, most pictures of c01 are 16x12")));
  WritePicture(temp / "0004/c01.png", 8, 6);
  const auto refused = FindOddPictures(*ListImageFolder(temp.path()));
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.status().message()),
              HasSubstr("16x12 (0000, 0001, 0002) and 8x6 (0004), 12x16 (0003)"));
}

}  // namespace
}  // namespace weft
