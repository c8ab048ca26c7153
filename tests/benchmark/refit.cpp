#include "tests/benchmark/refit.h"

namespace weft::testing {

absl::Status ForEachView(const std::string& folder,
                         absl::FunctionRef<void(const NodesOfView&, ViewDecoder&)> visit) {
  const auto take = ReadTrueTake(folder);
  if (!take.ok()) return take.status();
  const auto index = BoardIndex::Build(take->board);
  if (!index.ok()) return index.status();
  for (const TrueView& view : take->views) {
    const auto decoder = ViewDecoder::Read(view.image, *index, {});
    if (!decoder.ok()) return decoder.status();
    visit(NodesOfView(view), **decoder);
  }
  return absl::OkStatus();
}

}  // namespace weft::testing
