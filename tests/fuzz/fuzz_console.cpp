// What browsers, or those who pretend to be some, send to the console.
#include "services/server/console/json_messages.h"
#include "services/server/console/request_target.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (const auto target = weft::ParseTarget(bytes); target.ok()) {
    weft::FuzzRequire(target->path.starts_with('/') && target->path.find("..") != 0);
    weft::FuzzRequire((target->path + "/").find("/../") == std::string::npos);
    weft::FuzzRequire(target->path.find('\0') == std::string::npos);
    (void)weft::RequestOfQuery(*weft::FindMethod("Jobs/FetchResult")->input_type(), target->query);
  }
  if (const auto range = weft::ParseRange(bytes))
    weft::FuzzRequire(range->first >= 0 && (!range->last || *range->last >= range->first));
  const std::string cookie = weft::CookieValue(bytes, "weft_80");
  weft::FuzzRequire(cookie.find(';') == std::string::npos);
  const auto order = weft::ParseSocketOrder(bytes);
  if (!order.ok() || order->method.empty()) return 0;
  const auto* method = weft::FindMethod(order->method);
  if (method == nullptr) return 0;
  const auto wire = weft::RequestOfJson(*method->input_type(), order->json);
  weft::FuzzRequire(!wire.ok() || weft::JsonOfAnswer(*method->input_type(), *wire).ok());
  return 0;
}

std::vector<std::string> weft::FuzzSeeds() {
  return {"/file/Jobs/FetchResult?job_id=a%20b&kind=RESULT_KIND_MESH&offset=5",
          "bytes=0-99",
          "a=1; weft_80=0123; b=2",
          "12 Jobs.WatchJob\n{\"jobId\":\"a\"}",
          "3 cancel",
          "4 Jobs.SubmitJob\n{\"spec\":{\"dump\":\"/a\",\"options\":{\"preset\":\"best\"}},\"priority\":2}"};
}
