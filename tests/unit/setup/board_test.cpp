// Boards recognised in drawn pictures.
#include "daemon/setup/board.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/geometry/pose.hpp"
#include "daemon/setup/camera_calibration.hpp"
#include "daemon/setup/chessboard_evidence.hpp"

namespace perimap {
namespace {

using testing::HasSubstr;

// A picture of the board from a pinhole camera, smoothed a little.
cv::Mat picture_of(const cv::Mat& board, const Vector3d& turn, double distance) {
  const double f = 1000.0;
  const Matrix3d R = so3_exp(turn);
  Matrix3d place;  // of the board's pixels in the camera's frame, board 1 wide
  const double unit = 1.0 / board.cols;
  place.col(0) = R.col(0) * unit;
  place.col(1) = R.col(1) * unit;
  place.col(2) = -0.5 * R.col(0) - 0.5 * board.rows * unit * R.col(1) + Vector3d(0.0, 0.0, distance);
  Matrix3d K;
  K << f, 0.0, 640.0, 0.0, f, 360.0, 0.0, 0.0, 1.0;
  const Matrix3d H = K * place;
  cv::Mat M(3, 3, CV_64F);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) M.at<double>(i, j) = H(i, j);
  }
  cv::Mat picture;
  cv::warpPerspective(board, picture, M, {1280, 720}, cv::INTER_AREA, cv::BORDER_CONSTANT, cv::Scalar(128));
  cv::GaussianBlur(picture, picture, {3, 3}, 0.8);
  return picture;
}

GreyImage grey_of(const cv::Mat& picture) {
  return {picture.data, picture.cols, picture.rows, static_cast<std::ptrdiff_t>(picture.step)};
}

const std::vector<Vector3d> kTurns{{0.0, 0.0, 0.0},  {0.5, 0.0, 0.1},    {0.0, 0.5, -0.2}, {-0.4, 0.3, 0.4},
                                   {0.3, -0.5, 0.2}, {-0.5, -0.2, -0.3}, {0.2, 0.5, 0.3},  {0.4, -0.3, -0.4}};

TEST(Board, ACharucoBoardIsRecognisedWithSizeAndDictionary) {
  for (const auto& [columns, rows] : {std::pair(9, 7), std::pair(8, 5), std::pair(10, 6)}) {
    const auto layout = cv::aruco::CharucoBoard::create(columns, rows, 1.0F, 0.75F,
                                                        cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_100));
    cv::Mat drawn;
    layout->draw({columns * 90, rows * 90}, drawn, 0, 1);
    std::vector<cv::Mat> pictures;
    std::vector<GreyImage> greys;
    for (const Vector3d& turn : kTurns) pictures.push_back(picture_of(drawn, turn, 1.3));
    for (const cv::Mat& picture : pictures) greys.push_back(grey_of(picture));
    const auto board = recognise_board(greys, {});
    ASSERT_TRUE(board) << board.error().message;
    EXPECT_EQ(board->kind, BoardKind::kCharuco);
    EXPECT_EQ(board->columns, columns);
    EXPECT_NEAR(board->marker_share, 0.75, 0.03);
    EXPECT_THAT(name_of(*board), HasSubstr("5X5_"));
    const auto view = find_board(greys[1], *board);
    ASSERT_TRUE(view);
    EXPECT_GE(view->px.size(), static_cast<std::size_t>((columns - 1) * (rows - 1) * 3 / 4));
  }
}

// Of 9x6 inner corners.
std::vector<cv::Mat> chessboard_pictures() {
  cv::Mat drawn(8 * 80, 11 * 80, CV_8UC1, cv::Scalar(255));
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 10; ++x) {
      if ((x + y) % 2 == 0) drawn(cv::Rect(40 + 80 * x, 40 + 80 * y, 80, 80)).setTo(0);
    }
  }
  std::vector<cv::Mat> pictures;
  for (const Vector3d& turn : kTurns) pictures.push_back(picture_of(drawn, turn, 1.4));
  return pictures;
}

TEST(Board, AnotherThanTheOneThatIsNamedIsRefusedByItsName) {
  std::vector<GreyImage> greys;
  const auto pictures = chessboard_pictures();
  for (const cv::Mat& picture : pictures) greys.push_back(grey_of(picture));
  BoardWish wish;
  wish.kind = BoardKind::kChessboard;
  wish.columns = 8, wish.rows = 5;
  for (const BoardKind kind : {BoardKind::kChessboard, BoardKind::kCharuco, BoardKind::kCircles}) {
    wish.kind = kind;
    const auto board = recognise_board(greys, wish);
    ASSERT_FALSE(board);
    EXPECT_THAT(board.error().message, HasSubstr("the pictures show a chessboard of 9x6 inner corners, and not"));
  }
  wish.kind = BoardKind::kChessboard;
  wish.columns = 6, wish.rows = 9;
  EXPECT_TRUE(recognise_board(greys, wish));
}

TEST(Board, AChessboardIsRecognisedWithItsSize) {
  std::vector<GreyImage> greys;
  const auto pictures = chessboard_pictures();
  for (const cv::Mat& picture : pictures) greys.push_back(grey_of(picture));
  const auto board = recognise_board(greys, {});
  ASSERT_TRUE(board) << board.error().message;
  EXPECT_EQ(board->kind, BoardKind::kChessboard);
  EXPECT_EQ(board->columns, 9);
  EXPECT_EQ(board->rows, 6);
  std::vector<BoardView> views;
  for (const GreyImage& grey : greys) {
    if (auto view = find_board(grey, *board)) views.push_back(*view);
  }
  ASSERT_EQ(views.size(), kTurns.size());
  const auto result = calibrate_camera(views, 1280, 720, {});
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_NEAR(result->camera.fx, 1000.0, 5.0);
  EXPECT_NEAR(result->camera.cx, 640.0, 5.0);
  EXPECT_LT(result->rms_px, 0.2);
}

// Folds and vessels: noise of a few sizes, with gloss.
cv::Mat texture(std::uint64_t seed) {
  cv::RNG rng(seed);
  cv::Mat sum(480, 640, CV_32F, cv::Scalar(110));
  for (const double size : {4.0, 9.0, 25.0}) {
    cv::Mat noise(sum.size(), CV_32F);
    rng.fill(noise, cv::RNG::NORMAL, 0.0, 1.0);
    cv::GaussianBlur(noise, noise, {}, size);
    cv::Scalar mean, deviation;
    cv::meanStdDev(noise, mean, deviation);
    sum += noise * (24.0 / deviation[0]);
  }
  cv::Mat picture;
  sum.convertTo(picture, CV_8U);
  return picture;
}

TEST(Board, TextureInWhichCornersAreFoundIsNoBoard) {
  std::vector<cv::Mat> pictures;
  std::vector<GreyImage> greys;
  std::size_t taken_for_corners = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) pictures.push_back(texture(seed));
  for (const cv::Mat& picture : pictures) {
    std::vector<cv::Point2f> corners;
    taken_for_corners +=
        cv::findChessboardCornersSB(picture, {3, 3}, corners,
                                    cv::CALIB_CB_LARGER | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE)
            ? 1
            : 0;
    greys.push_back(grey_of(picture));
  }
  ASSERT_GE(taken_for_corners, 1U);  // else the textures try nothing
  const auto board = recognise_board(greys, {});
  ASSERT_FALSE(board) << name_of(*board);
  EXPECT_THAT(board.error().message, HasSubstr("no board is seen"));
}

// Of 5x4 inner corners, straight ahead, and where they are.
struct FoundBoard {
  cv::Mat picture{480, 640, CV_8UC1, cv::Scalar(235)};
  std::vector<cv::Point2f> corners;
};

FoundBoard found_board() {
  constexpr int kSide = 60;
  FoundBoard found;
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 6; ++x) {
      if ((x + y) % 2 == 0) found.picture(cv::Rect(140 + kSide * x, 90 + kSide * y, kSide, kSide)).setTo(25);
      if (x > 0 && y > 0) {
        found.corners.emplace_back(static_cast<float>(140 + kSide * x), static_cast<float>(90 + kSide * y));
      }
    }
  }
  return found;
}

TEST(ChessboardEvidence, SquaresAroundTheCornersMayBeInTheDarkOrHeld) {
  const FoundBoard whole = found_board();
  ASSERT_TRUE(is_chessboard(whole.picture, whole.corners, 5, 4));
  const cv::Rect between(200, 150, 240, 180);
  for (const int level : {0, 60, 150, 235}) {  // field stop, glove, finger, gloss
    FoundBoard held = found_board();
    held.picture.setTo(level);
    whole.picture(between).copyTo(held.picture(between));
    EXPECT_TRUE(is_chessboard(held.picture, held.corners, 5, 4)) << level;
  }
  FoundBoard half = found_board();
  half.picture(cv::Rect(0, 0, 230, 480)).setTo(120);  // a thumb along one side
  half.picture(cv::Rect(0, 0, 640, 150)).setTo(0);
  whole.picture(between).copyTo(half.picture(between));
  EXPECT_TRUE(is_chessboard(half.picture, half.corners, 5, 4));
}

TEST(ChessboardEvidence, SquaresAroundTheCornersThatAreTheOtherWayRoundAreAnotherPattern) {
  const FoundBoard whole = found_board();
  FoundBoard turned = found_board();
  cv::bitwise_not(turned.picture, turned.picture);
  const cv::Rect between(200, 150, 240, 180);
  whole.picture(between).copyTo(turned.picture(between));
  EXPECT_FALSE(is_chessboard(turned.picture, turned.corners, 5, 4));
  FoundBoard grey = found_board();
  grey.picture(between).setTo(128);
  EXPECT_FALSE(is_chessboard(grey.picture, grey.corners, 5, 4)) << "nothing between the corners";
}

TEST(Board, AChessboardOfFewSquaresIsOne) {
  cv::Mat drawn(6 * 80, 6 * 80, CV_8UC1, cv::Scalar(255));
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 5; ++x) {
      if ((x + y) % 2 == 0) drawn(cv::Rect(40 + 80 * x, 60 + 80 * y, 80, 80)).setTo(0);
    }
  }
  std::vector<cv::Mat> pictures;
  std::vector<GreyImage> greys;
  for (const Vector3d& turn : kTurns) pictures.push_back(picture_of(drawn, turn, 1.8));
  for (const cv::Mat& picture : pictures) greys.push_back(grey_of(picture));
  const auto board = recognise_board(greys, {});
  ASSERT_TRUE(board) << board.error().message;
  EXPECT_EQ(name_of(*board), "chessboard of 4x3 inner corners");
  // The finder takes other corners for it in one or two.
  std::size_t seen = 0;
  for (const GreyImage& grey : greys) seen += find_board(grey, *board) ? 1 : 0;
  EXPECT_GE(seen, 6U);
}

TEST(Board, PicturesWithoutOneAreRefused) {
  const cv::Mat empty(480, 640, CV_8UC1, cv::Scalar(90));
  const auto board = recognise_board({grey_of(empty), grey_of(empty)}, {});
  ASSERT_FALSE(board);
  EXPECT_THAT(board.error().message, HasSubstr("no board is seen"));
}

}  // namespace
}  // namespace perimap
