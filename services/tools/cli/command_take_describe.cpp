// weft take describe, search: what takes are called on the set, and which ones have it in their words.
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_join.h"
#include "absl/strings/strip.h"
#include "base/path_facts.h"
#include "services/studio/recording/take_description.h"
#include "services/studio/recording/take_words.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/client/take_client.h"

namespace weft {
namespace {

struct DescribeOptions {
  std::string take, server;
  std::optional<std::string> slate, name, notes;
  bool json = false;
};

struct SearchOptions {
  std::vector<std::string> words;
  std::string folder = ".";
  bool json = false;
};

// What a take is called, for lists.
std::string NamesOf(const v1::Take& take) {
  std::vector<std::string> names;
  for (const std::string* text : {&take.slate(), &take.name(), &take.timecode()})
    if (!text->empty()) names.push_back(*text);
  return names.empty() ? take.origin() : absl::StrJoin(names, "  ");
}

absl::Status DescribeAtDaemon(const DescribeOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const auto connection, RegistrationClient::Connect(options.server));
  TakeClient client(*connection);
  v1::DescribeTakeRequest request;
  request.set_take_id(std::string(absl::StripPrefix(options.take, "take:")));
  // The call replaces slate and notes, so what is not given is asked for first.
  WEFT_ASSIGN_OR_RETURN(const v1::ListTakesResponse known, client.List(0, false, request.take_id()));
  for (const v1::RecordedTake& take : known.takes()) {
    if (take.id() != request.take_id()) continue;
    request.set_slate(take.keeping().slate());
    request.set_notes(take.keeping().notes());
  }
  if (options.slate) request.set_slate(*options.slate);
  if (options.notes) request.set_notes(*options.notes);
  if (options.name) request.set_name(*options.name);
  WEFT_ASSIGN_OR_RETURN(const v1::RecordedTake take, client.Describe(request));
  if (options.json) return PrintJsonMessage(take);
  std::printf("%s  %s  %s\n", take.id().c_str(), take.keeping().slate().c_str(),
              take.keeping().name().c_str());
  return absl::OkStatus();
}

absl::Status DescribeHere(const DescribeOptions& options) {
  if (!options.slate && !options.name && !options.notes)
    return absl::InvalidArgumentError("say something of the take: --slate, --name or --notes");
  // A daemon's takes go by their ids: a folder is meant here, also where WEFT_SERVER is set.
  if (!options.server.empty() && !IsFolder(options.take)) return DescribeAtDaemon(options);
  if (absl::StartsWith(options.take, "take:"))
    return absl::InvalidArgumentError("take:ID is a take of a daemon: name it, --server HOST:PORT");
  WEFT_ASSIGN_OR_RETURN(const v1::Take take,
                        DescribeTakeFile(options.take, {options.slate, options.name, options.notes}));
  if (options.json) return PrintJsonMessage(take);
  std::printf("%s  %s\n", options.take.c_str(), NamesOf(take).c_str());
  return absl::OkStatus();
}

absl::Status SearchHere(const SearchOptions& options) {
  WEFT_ASSIGN_OR_RETURN(const auto found, FindTakes(options.folder, absl::StrJoin(options.words, " ")));
  if (found.empty() && !options.json) std::printf("no take in %s has these words\n", options.folder.c_str());
  for (const FoundTake& one : found) {
    if (options.json) {
      WEFT_RETURN_IF_ERROR(PrintJsonMessage(one.take));
      continue;
    }
    std::printf("%s  %s sets  %s\n", one.folder.c_str(), WithSeparators(one.take.sets_recorded()).c_str(),
                NamesOf(one.take).c_str());
  }
  return absl::OkStatus();
}

}  // namespace

void AddTakeDescribeCommands(CLI::App& take, CommandLine& line) {
  const auto [describe, described] = AddCommand<DescribeOptions>(
      take, line, DescribeHere, "describe",
      "Say what a take is called on the set, and what else should be known of it. What is not given "
      "stays, and an empty text takes away what was said. It stands in take.json, and `weft take info`, "
      "`list` and `search`, reports and the console show it.",
      "  weft take describe take --slate \"12A take 3\" --name walk --notes \"left sleeve is wet\"\n"
      "  weft take describe take:20260131-104500-1a2b3c4d --slate 12B --server 127.0.0.1:7411");
  AddRequired(*describe, "TAKE", described->take, "Folder of the take; with --server, its id");
  // CLI11 takes an empty text for an option that is not given, and it is one: the text goes away.
  const auto add_text = [to = describe](const char* name, std::optional<std::string>& text,
                                        const char* about) {
    to->add_option_function<std::string>(
          name, [place = &text](const std::string& given) { *place = given; }, about)
        ->type_name("TEXT");
  };
  add_text("--slate", described->slate, "A line");
  add_text("--name", described->name, "A line");
  add_text("--notes", described->notes, "Up to 4096 bytes, in lines");
  AddServerOption(*describe, described->server, "HOST:PORT of the daemon that has the take");
  describe->add_flag("--json", described->json, "Print JSON");

  const auto [search, searched] = AddCommand<SearchOptions>(
      take, line, SearchHere, "search",
      "List the takes in a folder in whose slate, name, notes, id, timecode, origin or path all "
      "words stand, whatever their case. A daemon's: `weft take list --search`.",
      "  weft take search 12A walk --in /data/takes");
  AddOption(*search, "WORDS", searched->words, "None: all takes");
  AddOption(*search, "--in DIR", searched->folder, "A folder with takes in it, or in its folders");
  search->add_flag("--json", searched->json, "Print take.json of each (weft.v1.Take)");
}

}  // namespace weft
