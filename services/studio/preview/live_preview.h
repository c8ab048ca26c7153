// A page that shows what the cameras see while a take is recorded.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "alignment/template.h"
#include "capture/image/raw_frame.h"
#include "pattern/board/board.h"

namespace weft {

struct LivePreviewOptions {
  std::string folder;  // index.html is written there, again and again
  std::string title = "Live preview";
  double interval_s = 1;            // at least, between pages
  int thumbnail_px = 360;           // width
  std::optional<Board> board;       // its cells are looked for
  std::optional<Template> garment;  // of this board; coverage is of its cells, else of the whole board
  int decoded_views = 2;            // cameras that are decoded for a page, in turn

  absl::Status Validate() const;
};

// Frame sets are offered and passed over unless the page before is done: nobody waits for the preview, and it
// holds two sets at most. Its one thread has the lowest priority and works half of the time at most. Thread
// safety: any thread may offer and describe.
class LivePreview {
 public:
  // Makes the folder and writes a first page. InvalidArgument: options; errors of the folder.
  static absl::StatusOr<std::unique_ptr<LivePreview>> Start(const LivePreviewOptions& options);
  // As Stop, with the result lost.
  ~LivePreview();

  void Offer(const RawFrameSet& set);
  // What the recording is doing, in words, for the pages to come.
  void Describe(std::string state);
  // Waits for the page in work, decodes no more, and marks it as the last one: a recording that ends waits
  // for no look at it. The first page that could not be written; the preview went on.
  absl::Status Stop();
  // As Stop, with a whole page of the last set that was offered.
  absl::Status Finish();

 private:
  class Impl;
  explicit LivePreview(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace weft
