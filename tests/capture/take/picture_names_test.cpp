#include "capture/take/picture_names.h"

#include <gtest/gtest.h>

namespace weft {
namespace {

TEST(PictureNames, TellsPicturesAndOtherProgramsFilesApart) {
  for (const char* name : {"c00.png", "C00.PNG", "a.b.JpEg", "c.tif", "c.TIFF", "x.jpg", "@cam.png"})
    EXPECT_TRUE(IsPictureName(name) && !IsForeignName(name)) << name;
  for (const char* name : {"c00.pn", "png", "c00.png~", "c00.exr", "", "c00.png.tmp"})
    EXPECT_FALSE(IsPictureName(name)) << name;
  for (const char* name : {"._c00.png", ".DS_Store", ".thumbnails", "@eaDir", "#recycle", "lost+found",
                           "Thumbs.db", "THUMBS.DB", "$RECYCLE.BIN", "System Volume Information", "__MACOSX"})
    EXPECT_TRUE(IsForeignName(name)) << name;
}

}  // namespace
}  // namespace weft
