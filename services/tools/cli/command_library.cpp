// weft library: rigs, boards, templates, dumps and avatars in the library of a daemon.
#include <cstdio>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"
#include "services/ground/process/exit_status.h"
#include "services/tools/cli/commands.h"
#include "services/tools/cli/json_output.h"
#include "services/tools/cli/progress.h"
#include "services/tools/cli/remote_command.h"
#include "services/tools/cli/upload_inputs.h"
#include "services/tools/client/library_client.h"
#include "services/work/items/item_words.h"

namespace weft {
namespace {

struct LibraryOptions {
  std::string server;
  std::string kind;
  std::string path;
  std::string name;
  std::string item;
  std::string out;
  bool json = false;
};

using LibraryContext = RemoteContext<RegistrationClient, LibraryOptions>;

absl::Status CheckLibraryKind(const LibraryOptions& options) {
  return options.kind.empty() ? absl::OkStatus() : ParseItemKind(options.kind).status();
}

v1::ItemKind LibraryKindOf(const LibraryContext& context) {
  return ParseItemKind(context.options.kind).value_or(v1::ITEM_KIND_UNSPECIFIED);
}

std::string ItemText(const v1::LibraryItem& item) {
  const std::string content =
      absl::StrFormat("%-8s  %7d files  %12.3f MB  sha256:%s", ItemKindWord(item.kind()), item.file_count(),
                      static_cast<double>(item.bytes()) / 1e6, item.id());
  std::string text;
  for (const v1::ItemName& name : item.names()) {
    const absl::Time time = absl::FromUnixNanos(name.created_unix_ns());
    absl::StrAppend(&text, content, "  ", absl::FormatTime("%Y-%m-%d %H:%M:%S", time, absl::LocalTimeZone()),
                    "  ", name.name(), "@", name.version(), "\n");
  }
  return text.empty() ? content + "\n" : text;
}

absl::Status PrintItem(const absl::StatusOr<v1::LibraryItem>& item, const LibraryContext& context) {
  return PrintAnswer(item, context,
                     [](const v1::LibraryItem& one) { std::fputs(ItemText(one).c_str(), stdout); });
}

absl::Status UploadItem(const LibraryContext& context) {
  const LibraryOptions& options = context.options;
  return PrintItem(
      UploadInput(context.client, {LibraryKindOf(context), options.path, options.name}, context.quiet),
      context);
}

absl::Status ListItems(const LibraryContext& context) {
  WEFT_ASSIGN_OR_RETURN(const v1::ListItemsResponse list,
                        LibraryClient(context.client).List(LibraryKindOf(context)));
  if (context.options.json) return PrintJsonMessage(list);
  for (const std::string& damaged : list.damaged()) PrintWarning(damaged);
  if (list.items().empty()) std::printf("no items at %s\n", context.options.server.c_str());
  for (const v1::LibraryItem& item : list.items()) std::fputs(ItemText(item).c_str(), stdout);
  return absl::OkStatus();
}

absl::Status GetItem(const LibraryContext& context) {
  LibraryClient library(context.client);
  WEFT_ASSIGN_OR_RETURN(const v1::LibraryItem item,
                        library.Get(LibraryKindOf(context), context.options.item));
  if (!context.options.out.empty()) {
    Progress bar("get", static_cast<uint64_t>(item.bytes()), ProgressVisible(context.quiet),
                 ProgressUnit::kPercent);
    WEFT_RETURN_IF_ERROR(library.Fetch(item, context.options.out,
                                       [&bar](uint64_t done, uint64_t total) { bar.Set(done, total); }));
  }
  return PrintItem(item, context);
}

absl::Status DeleteItem(const LibraryContext& context) {
  const auto deleted = LibraryClient(context.client).Delete(LibraryKindOf(context), context.options.item);
  return PrintAnswer(deleted, context, [](const v1::DeleteItemResponse& answer) {
    std::puts(answer.content_deleted() ? "deleted" : "name deleted; other names keep the content");
  });
}

CLI::Option* AddLibraryKind(CLI::App& command, LibraryOptions& options) {
  return AddOption(command, "KIND", options.kind, "rig, board, template, dump, avatar or garment");
}

void AddItemArguments(CLI::App& command, LibraryOptions& options) {
  AddLibraryKind(command, options)->required();
  AddRequired(command, "ITEM", options.item, "NAME (its newest version), NAME@VERSION or sha256:HEX");
}

void AddUploadArguments(CLI::App& command, LibraryOptions& options) {
  AddLibraryKind(command, options)->required();
  AddRequired(command, "PATH", options.path,
              "rig.json; board.json or board.png; the folder of a template, of a dump or of an avatar");
  AddOption(command, "--name NAME", options.name, "Name in the library; that of PATH without it");
}

void AddGetArguments(CLI::App& command, LibraryOptions& options) {
  AddItemArguments(command, options);
  AddOption(command, "--out DIR", options.out, "Copy the files to this folder, made where it is missing");
}

void AddItemListArguments(CLI::App& command, LibraryOptions& options) { AddLibraryKind(command, options); }

}  // namespace

void AddLibraryCommand(CLI::App& app, CommandLine& line) {
  CLI::App* library = AddGroup(
      app, "library",
      "Rigs, boards, templates, dumps and avatars in the library of a daemon, for clients that share no "
      "folder with it. Jobs name them library:NAME, library:NAME@VERSION or library:sha256:HEX",
      "  weft library upload rig rig.json --name studio --server studio:7411\n"
      "  weft register library:jump --rig library:studio --board library:stripes --template library:shirt "
      "--out result --server studio:7411");
  const RemoteCommand<RegistrationClient, LibraryOptions> commands[] = {
      {"upload",
       "Send a rig, board, template, dump, avatar or garment (OBJ, PLY) to the library. Other content under "
       "a "
       "name that is taken becomes its next version. An upload that was stopped goes on when the command is "
       "repeated, and "
       "content that the daemon has is not sent",
       "  weft library upload rig rig.json --name studio --server studio:7411\n"
       "  weft library upload template shirt --server studio:7411\n"
       "  weft library upload dump /data/jump --server studio:7411\n"
       "  weft library upload avatar shirt.avatar --server studio:7411",
       AddUploadArguments, UploadItem, true, true, CheckLibraryKind},
      {"list", "List the items of the library with all their names and versions",
       "  weft library list --server studio:7411\n"
       "  weft library list rig --server studio:7411",
       AddItemListArguments, ListItems, true, true, CheckLibraryKind},
      {"get", "Show an item, and with --out copy its files to this machine",
       "  weft library get rig studio --server studio:7411\n"
       "  weft library get rig studio@2 --out rig --server studio:7411",
       AddGetArguments, GetItem, true, true, CheckLibraryKind},
      {"delete",
       "Delete a version of an item. The content goes with its last name; it stays while a job that has not "
       "ended uses it",
       "  weft library delete rig studio@1 --server studio:7411", AddItemArguments, DeleteItem, true, true,
       CheckLibraryKind}};
  for (const auto& command : commands) AddRemoteCommand(*library, line, command);
}

}  // namespace weft
