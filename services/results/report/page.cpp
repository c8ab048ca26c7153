#include "services/results/report/page.h"

#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>
#include <openssl/sha.h>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "services/results/report/html_text.h"
#include "services/results/report/page_program.h"

namespace weft {
namespace {

// As a policy names what may run: "'sha256-...'".
std::string HashOf(std::string_view text) {
  std::string hash(SHA256_DIGEST_LENGTH, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(),
         reinterpret_cast<unsigned char*>(hash.data()));
  return absl::StrCat("'sha256-", Base64(hash), "'");
}

std::string JsonOf(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  options.preserve_proto_field_names = true;
  std::string json;
  const bool is_written = google::protobuf::util::MessageToJsonString(message, &json, options).ok();
  return is_written ? json : "null";
}

// JSON has '<' in texts alone, so none of them can end the element.
std::string DataOf(const ReportPage& page) {
  std::string data = "{";
  for (const auto& [name, message] : page.data)
    absl::StrAppend(&data, data.size() > 1 ? ",\n" : "\n", "\"", name,
                    "\":", message != nullptr ? JsonOf(*message) : "null");
  data += "\n}";
  return data.find('<') == std::string::npos ? data : absl::StrReplaceAll(data, {{"<", "\\u003c"}});
}

}  // namespace

std::string MakePage(const ReportPage& page) {
  static const std::string kPolicy = absl::StrCat("default-src 'none'; img-src data:; style-src ",
                                                  HashOf(kPageStyle), "; script-src ", HashOf(kPageProgram));
  return absl::StrCat(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"",
      kPolicy,
      "\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light dark\">\n<title>",
      EscapeHtml(page.title), "</title>\n<style>", kPageStyle,
      "</style>\n</head>\n<body>\n<main><noscript>This page shows its data by JavaScript, which is off "
      "here.</noscript></main>\n<script type=\"application/json\" id=\"data\" data-kind=\"",
      page.kind, "\">", DataOf(page), "</script>\n<script>", kPageProgram, "</script>\n</body>\n</html>\n");
}

}  // namespace weft
