#include "services/ground/process/help.h"

#include <gtest/gtest.h>

#include <vector>

#include "services/ground/process/command_option.h"

namespace weft {
namespace {

TEST(WrapText, BreaksAtSpacesAndIndentsWhatFollows) {
  EXPECT_EQ(WrapText("one two three", 8, 2), "one two\n  three");
  EXPECT_EQ(WrapText("a\nb", 80, 4), "a\n    b");
  EXPECT_EQ(WrapText("unbreakable", 3, 0), "unbreakable");
}

TEST(WrapText, FillsLinesToTheirLastCharacter) {
  EXPECT_EQ(WrapText("abc def", 7, 0), "abc def");
  EXPECT_EQ(WrapText("abc def", 6, 1), "abc\n def");
  EXPECT_EQ(WrapText("abc de f gh", 6, 0), "abc de\nf gh");
  EXPECT_EQ(WrapText("ab cd ef gh ij", 5, 0), "ab cd\nef gh\nij");
  EXPECT_EQ(WrapText("  a   b  ", 80, 0), "a b");
  EXPECT_EQ(WrapText("long enough\nab cd", 80, 1), "long enough\n ab cd");
  EXPECT_EQ(WrapText("1234567\n89 0", 7, 0), "1234567\n89 0");
  EXPECT_EQ(WrapText("", 80, 3), "");
}

class HelpTest : public ::testing::Test {
 protected:
  HelpTest() { app_.formatter(MakeHelpFormatter()); }

  // The rows between a headline and the next empty line.
  std::string Rows(const std::string& headline) {
    const std::string help = app_.help();
    const size_t begin = help.find(headline + ":\n");
    if (begin == std::string::npos) return "no " + headline;
    const size_t rows = begin + headline.size() + 2;
    return help.substr(rows, help.find("\n\n", rows) + 1 - rows);
  }

  CLI::App app_{"Registers cloth."};
  int number_ = 7;
  std::string text_;
  std::vector<std::string> texts_;
  bool flag_ = false;
};

TEST_F(HelpTest, OptionsShowWhatTheyTakeAndWhatStandsWithoutThem) {
  app_.set_help_flag();
  AddRequired(app_, "--rig FILE", text_, "The cameras.");
  AddOption(app_, "--seed N", number_, "Of the draw.")->capture_default_str();
  AddOption(app_, "-t,--title TEXT", text_, "A name. No more.");
  AddOption(app_, "--camera ID", texts_, "One or more.")->expected(1, 3);
  app_.add_flag("--quiet", flag_, "Says nothing.");
  EXPECT_EQ(Rows("Options"),
            "  --rig FILE                  The cameras. (required)\n"
            "  --seed N                    Of the draw. (default 7)\n"
            "  -t,--title TEXT             A name. No more.\n"
            "  --camera ID...              One or more.\n"
            "  --quiet                     Says nothing.\n");
}

TEST_F(HelpTest, ValuesAreListedWhereTheTextNamesNotAll) {
  app_.set_help_flag();
  const CLI::Validator colors = CLI::IsMember(std::vector<std::string>{"red", "green"});
  AddOption(app_, "--ink COLOR", text_, "The colour", colors);
  AddOption(app_, "--rim COLOR", text_, "The colour, red or so", colors);
  AddOption(app_, "--paper COLOR", text_, "The colour: red, green.", colors);
  AddOption(app_, "--sheets N", number_, "How many", CLI::Range(1, 9));
  EXPECT_EQ(Rows("Options"),
            "  --ink COLOR                 The colour: red, green\n"
            "  --rim COLOR                 The colour, red or so: red, green\n"
            "  --paper COLOR               The colour: red, green.\n"
            "  --sheets N                  How many\n");
}

TEST_F(HelpTest, NamesThatAreTooLongStandAlone) {
  app_.set_help_flag();
  app_.add_flag("--" + std::string(24, 'a'), flag_, "Fits.");
  app_.add_flag("--" + std::string(25, 'b'), flag_, "Does not.");
  const std::string column(30, ' ');
  EXPECT_EQ(Rows("Options"), "  --" + std::string(24, 'a') + "  Fits.\n  --" + std::string(25, 'b') + "\n" +
                                 column + "Does not.\n");
}

TEST_F(HelpTest, TextsAreSeventyCharactersWideBesideTheirNames) {
  app_.set_help_flag();
  app_.add_flag("--fits", flag_, std::string(34, 'x') + " " + std::string(35, 'y'));
  app_.add_flag("--wraps", flag_, std::string(35, 'x') + " " + std::string(35, 'y'));
  const std::string column(30, ' ');
  EXPECT_EQ(Rows("Options"), "  --fits                      " + std::string(34, 'x') + " " +
                                 std::string(35, 'y') + "\n  --wraps                     " +
                                 std::string(35, 'x') + "\n" + column + std::string(35, 'y') + "\n");
}

TEST_F(HelpTest, SubcommandsHaveTheirFirstSentence) {
  app_.add_subcommand("take", "Records takes. Much more of that.");
  app_.add_subcommand("job", "Registers them");
  EXPECT_EQ(Rows("Subcommands"),
            "  take                        Records takes\n"
            "  job                         Registers them\n");
  EXPECT_EQ(app_.help().substr(0, 17), "Registers cloth.\n");
}

TEST_F(HelpTest, DescriptionsAreAHundredCharactersWide) {
  const std::string half(49, 'd');
  app_.description(half + " " + half + "d " + half);
  EXPECT_EQ(app_.help().substr(0, 151), half + " " + half + "d\n" + half + "\n");
}

TEST_F(HelpTest, PositionalsStandForThemselves) {
  AddRequired(app_, "take TAKE", text_, "Its folder");
  EXPECT_EQ(Rows("Positionals"), "  take                        Its folder (required)\n");
}

}  // namespace
}  // namespace weft
