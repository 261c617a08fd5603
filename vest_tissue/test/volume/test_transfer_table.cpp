// Protects the transfer tables: linear between rows, strict, and the five that are shipped can be read.
#include <fstream>

#include <gtest/gtest.h>

#include "temporary_scene.h"
#include "vest_tissue/volume/transfer_table.h"

namespace {

using namespace vest::volume;

const std::string kHead = "value,red,green,blue,alpha\n";

std::string refusal(const std::string& text) {
  const vest::test::TemporaryScene folder;
  try {
    readTransferTable(folder.write("a.csv", text));
    return {};
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

TEST(TransferTable, IsLinearBetweenRowsAndConstantBeyondThem) {
  const vest::test::TemporaryScene folder;
  const TransferTable table = readTransferTable(folder.write(
      "a.csv", "# a note\nvalue,red,green,blue,alpha,yield\n-100,0,0.5,1,0,0\n100,1,0.5,0,0.8,2\n"));
  EXPECT_DOUBLE_EQ(transfer(table, 50).colour[0], 0.75);
  EXPECT_DOUBLE_EQ(transfer(table, 50).alpha, 0.6);
  EXPECT_DOUBLE_EQ(transfer(table, 50).feel[1], 1.5);
  EXPECT_DOUBLE_EQ(transfer(table, 50).feel[0], 0) << "a column that is missing";
  EXPECT_DOUBLE_EQ(transfer(table, -5000).alpha, 0);
  EXPECT_DOUBLE_EQ(transfer(table, 5000).alpha, 0.8);
  EXPECT_DOUBLE_EQ(transfer(table, 100).alpha, 0.8);
}

TEST(TransferTable, RefusesWithLineAndColumn) {
  EXPECT_EQ(refusal(kHead + "0,0,0,0,0\n1,1,1,1,1\n"), "");
  for (const auto& [text, word] : std::vector<std::pair<std::string, std::string>>{
           {"", "header"},
           {kHead, "rows"},
           {kHead + "0,0,0,0,0\n", "rows"},
           {kHead + "0,0,0,0,0\n0,1,1,1,1\n", "above that of the row before"},
           {kHead + "0,0,0,0,0\n1,1,1,1,1.01\n", "a.csv:3: alpha"},
           {kHead + "0,0,-1,0,0\n1,1,1,1,1\n", "a.csv:2: green"},
           {kHead + "0,0,nan,0,0\n1,1,1,1,1\n", "green"},
           {kHead + "0,0,0,0\n1,1,1,1,1\n", "cells"},
           {"value,red,green,blue,opacity\n0,0,0,0,0\n", "opacity"},
           {"value,red,green,blue,alpha,yield\n0,0,0,0,0,-1\n", "yield"}})
    EXPECT_NE(refusal(text).find(word), std::string::npos) << text << refusal(text);
}

TEST(TransferTable, ThePresetsAreGood) {
  for (const char* const name : {"bone", "soft", "lung", "vessels", "skin"}) {
    const TransferTable table =
        readTransferTable(std::string(VEST_TISSUE_LIBRARY) + "/tables/" + name + ".csv");
    EXPECT_EQ(transfer(table, -1000).alpha, 0) << name << ": air is clear";
    EXPECT_GT(transfer(table, 1500).alpha, 0) << name;
  }
}

}  // namespace
