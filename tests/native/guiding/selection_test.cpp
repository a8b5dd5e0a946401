// "Off until proven on": synthetic regions where the guide wins, loses, or is fooled by one
// firefly.
#include "guiding/selection.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "support/random.h"

namespace pharos {
namespace {

using test::Random;

Bounds3 unit_box() {
    Bounds3 box;
    box.extend(Vec3(0.0f));
    box.extend(Vec3(1.0f));
    return box;
}

// A direction t in [0, 1) with f peaked in [0, 0.05): BSDF density 1, guide density 20 on the peak
// and almost nothing beside it when it is good; 20 on the other side when it is bad.
SelectionRecord peaked_record(Random& random, const Vec3& position, bool good, float share) {
    SelectionRecord r;
    r.position = position;
    r.normal = Vec3(0, 0, 1);
    const bool from_guide = random.uniform() < share;
    const bool guide_low = good == (random.uniform() < 0.98f);
    const float low = guide_low ? random.uniform(0.0f, 0.05f) : random.uniform(0.05f, 1.0f);
    const float t = from_guide ? low : random.uniform();
    const bool peak = t < 0.05f;
    const float peak_mass = good ? 0.98f : 0.02f;
    r.pdf_bsdf = 1.0f;
    r.pdf_guide = peak ? peak_mass / 0.05f : (1.0f - peak_mass) / 0.95f;
    r.pdf_used = share * r.pdf_guide + (1.0f - share) * r.pdf_bsdf;
    r.indirect = peak ? 20.0f : 0.01f;
    r.weight = 0.3f;
    r.key = random.bits();
    return r;
}

SelectionPass work() {
    return {4096.0, 16384.0, 1.5};
}

TEST(Selection, TurnsOnWhereTheGuideWinsAndStaysOffWhereItLoses) {
    GuideSelection selection(unit_box());
    Random random(1);
    const Vec3 win(0.2f, 0.2f, 0.2f);
    const Vec3 lose(0.8f, 0.8f, 0.8f);
    EXPECT_EQ(selection.alpha(win, Vec3(0, 0, 1), false), 0.0f);
    SelectionStatistics statistics;
    for (int pass = 0; pass < 6; ++pass) {
        std::vector<SelectionRecord> records;
        for (int i = 0; i < 500; ++i) {
            records.push_back(
                peaked_record(random, win, true, selection.alpha(win, Vec3(0, 0, 1), false)));
            for (int j = 0; j < 3; ++j) {
                records.push_back(peaked_record(
                    random, lose, false, selection.alpha(lose, Vec3(0, 0, 1), false)));
            }
        }
        statistics = selection.update(records, work());
    }
    EXPECT_GE(selection.alpha(win, Vec3(0, 0, 1), false), 0.5f);
    EXPECT_EQ(selection.alpha(lose, Vec3(0, 0, 1), false), 0.0f);
    EXPECT_NEAR(statistics.guided_share, 0.25, 0.05);
    EXPECT_FALSE(statistics.closed);
    // Another normal or glossiness is another cell.
    EXPECT_EQ(selection.alpha(lose, Vec3(0, 0, -1), false), 0.0f);
    EXPECT_EQ(selection.alpha(lose, Vec3(0, 0, 1), true), 0.0f);
}

TEST(Selection, OneFireflyDecidesNothing) {
    GuideSelection selection(unit_box());
    Random random(2);
    const Vec3 p(0.5f);
    for (int pass = 0; pass < 4; ++pass) {
        std::vector<SelectionRecord> records;
        for (int i = 0; i < 2000; ++i) {
            SelectionRecord r = peaked_record(random, p, true, 0.0f);
            r.indirect = 1.0f;  // flat: the guide can only lose
            records.push_back(r);
        }
        if (pass == 2) {
            records[7].pdf_guide = 50.0f;
            records[7].indirect = 1e9f;
        }
        selection.update(records, work());
        EXPECT_EQ(selection.alpha(p, Vec3(0, 0, 1), false), 0.0f) << pass;
    }
}

TEST(Selection, CostDecides) {
    // The same gain at a vertex that hardly matters to the pixel does not repay the guide's cost.
    GuideSelection selection(unit_box());
    Random random(3);
    const Vec3 p(0.5f);
    for (int pass = 0; pass < 4; ++pass) {
        std::vector<SelectionRecord> records;
        for (int i = 0; i < 2000; ++i) {
            SelectionRecord r = peaked_record(random, p, true, 0.0f);
            r.weight *= 1e-4f;
            records.push_back(r);
        }
        selection.update(records, work());
    }
    EXPECT_EQ(selection.alpha(p, Vec3(0, 0, 1), false), 0.0f);
}

TEST(Selection, EverywhereOnceMostIsOn) {
    GuideSelection selection(unit_box());
    Random random(4);
    const Vec3 never_seen(0.9f, 0.1f, 0.5f);
    for (int pass = 0; pass < 5; ++pass) {
        std::vector<SelectionRecord> records;
        for (int i = 0; i < 2000; ++i) {
            records.push_back(peaked_record(random, Vec3(0.5f), true, 0.0f));
        }
        selection.update(records, work());
    }
    EXPECT_GE(selection.alpha(never_seen, Vec3(1, 0, 0), true), 0.25f);
}

// Where paths vary much, the weight window adds to the gain: fewer on-cells are enough.
TEST(Selection, NoisyPicturesTurnOnEarlier) {
    for (const double variance : {6.0, 30.0}) {
        GuideSelection selection(unit_box());
        Random random(7);
        SelectionStatistics statistics;
        for (int pass = 0; pass < 6; ++pass) {
            std::vector<SelectionRecord> records;
            for (int i = 0; i < 3000; ++i) {
                SelectionRecord r =
                    peaked_record(random, i % 10 == 0 ? Vec3(0.1f) : Vec3(0.9f), i % 10 == 0, 0.0f);
                r.weight *= static_cast<float>(variance);
                records.push_back(r);
            }
            statistics = selection.update(records, {4096.0, 16384.0, variance});
        }
        const bool everywhere = selection.alpha(Vec3(0.9f), Vec3(0, 0, 1), false) > 0.0f;
        EXPECT_EQ(everywhere, variance > 10.0) << variance;
        EXPECT_NEAR(statistics.guided_share, everywhere ? 1.0 : 0.1, 0.05);
    }
}

// A's sum over what arrived, apart for diffuse and glossy vertices; and the share that gains most.
TEST(Selection, CalibrationIsWhatWasExpectedOverWhatArrived) {
    GuideSelection selection(unit_box());
    Random random(8);
    SelectionStatistics statistics;
    for (int pass = 0; pass < 3; ++pass) {
        std::vector<SelectionRecord> records;
        for (int i = 0; i < 2000; ++i) {
            SelectionRecord r = peaked_record(random, random.uniform3(), true, 0.25f);
            r.glossy = i % 2 == 0;
            const float arrived =
                (r.hit_radiance > 0.0f ? r.hit_radiance / (r.hit_pdf_light + r.pdf_used) : 0.0f) +
                r.indirect / r.pdf_used;
            r.expected = (r.glossy ? 0.5f : 3.0f) * arrived;
            r.weight = std::min(r.weight, 1e-4f);  // below the limit of one record
            records.push_back(r);
        }
        statistics = selection.update(records, work());
    }
    EXPECT_NEAR(statistics.calibration[0], 3.0, 1e-2);
    EXPECT_NEAR(statistics.calibration[1], 0.5, 1e-2);
    EXPECT_GT(statistics.best.share, 0.0f);
    EXPECT_NEAR(statistics.best_of_kind[0].part + statistics.best_of_kind[1].part, 1.0, 1e-9);
}

// In a quiet picture after the third pass, in a noisy one not before the ninth.
void expect_gate(double relative_variance, int expected_close) {
    GuideSelection selection(unit_box());
    SelectionPass counted = work();
    counted.relative_variance = relative_variance;
    Random random(5);
    int closed_at = -1;
    int opened_at = -1;
    for (int pass = 0; pass < 120; ++pass) {
        std::vector<SelectionRecord> records;
        for (int i = 0; i < 500; ++i) {
            records.push_back(peaked_record(random, Vec3(0.5f), false, 0.0f));
        }
        const SelectionStatistics statistics = selection.update(records, counted);
        EXPECT_EQ(statistics.closed, selection.closed());
        if (closed_at < 0 && selection.closed()) {
            closed_at = pass;
        } else if (closed_at >= 0 && opened_at < 0 && !selection.closed()) {
            opened_at = pass;
        }
    }
    EXPECT_EQ(closed_at, expected_close);
    EXPECT_EQ(opened_at, closed_at + 64);
    EXPECT_TRUE(selection.closed());
    EXPECT_EQ(selection.alpha(Vec3(0.5f), Vec3(0, 0, 1), false), 0.0f);
}

TEST(Selection, GateClosesWhereNothingPaysAndOpensByPassNumber) {
    expect_gate(1.0, 2);
    expect_gate(8.0, 8);
}

// A few regions that gain do not pay for asking everywhere; many do.
TEST(Selection, GateClosesWhereOnlyAFewRegionsGain) {
    for (const int one_in : {100, 3}) {
        GuideSelection selection(unit_box());
        SelectionPass counted = work();
        counted.relative_variance = 1.0;
        Random random(9);
        for (int pass = 0; pass < 4; ++pass) {
            std::vector<SelectionRecord> records;
            for (int i = 0; i < 3000; ++i) {
                const bool gains = i % one_in == 0;
                records.push_back(
                    peaked_record(random, gains ? Vec3(0.1f) : Vec3(0.9f), gains, 0.0f));
            }
            selection.update(records, counted);
        }
        EXPECT_EQ(selection.closed(), one_in > 10) << one_in;
    }
}

TEST(Selection, OrderOfRecordsDoesNotMatter) {
    GuideSelection first(unit_box());
    GuideSelection second(unit_box());
    Random random(6);
    for (int pass = 0; pass < 8; ++pass) {
        std::vector<SelectionRecord> records;
        for (int i = 0; i < 5000; ++i) {
            SelectionRecord r =
                peaked_record(random, random.uniform3(), random.uniform() < 0.5f, 0.25f);
            r.normal = random.direction();
            r.glossy = random.uniform() < 0.3f;
            r.weight = random.log_uniform(1e-3f, 10.0f);
            r.nee_radiance = random.uniform();
            r.nee_pdf_light = random.uniform(0.1f, 4.0f);
            r.nee_pdf_bsdf = random.uniform();
            r.nee_pdf_guide = random.uniform();
            r.hit_radiance = random.uniform() < 0.2f ? random.uniform() : 0.0f;
            r.hit_pdf_light = random.uniform();
            records.push_back(r);
        }
        const SelectionStatistics a = first.update(records, work());
        std::reverse(records.begin(), records.end());
        std::rotate(records.begin(), records.begin() + 1234, records.end());
        const SelectionStatistics b = second.update(records, work());
        ASSERT_EQ(a.guided_share, b.guided_share);
        ASSERT_EQ(a.best.moment_ratio, b.best.moment_ratio);
        for (std::size_t kind = 0; kind < 2; ++kind) {
            ASSERT_EQ(a.best_of_kind[kind].moment_ratio, b.best_of_kind[kind].moment_ratio);
        }
        ASSERT_EQ(a.cells_on, b.cells_on);
    }
    for (int i = 0; i < 10000; ++i) {
        const Vec3 p = random.uniform3();
        const Vec3 n = random.direction();
        ASSERT_EQ(first.alpha(p, n, i % 2 == 0), second.alpha(p, n, i % 2 == 0));
    }
}

TEST(Selection, BrokenInputIsHarmless) {
    GuideSelection selection(unit_box());
    const float nan = std::nanf("");
    SelectionRecord r;
    std::vector<SelectionRecord> records;
    for (const float bad : {nan, kInfinity, -kInfinity, 0.0f, -1.0f, 1e38f}) {
        r.weight = bad;
        r.pdf_used = 1.0f;
        r.indirect = 1.0f;
        r.pdf_bsdf = 1.0f;
        r.pdf_guide = 1.0f;
        records.push_back(r);
        r.weight = 1.0f;
        r.pdf_bsdf = bad;
        records.push_back(r);
        r.pdf_bsdf = 1.0f;
        r.position = Vec3(bad);
        records.push_back(r);
        r.position = Vec3(0.5f);
        r.nee_radiance = 1.0f;
        r.nee_pdf_light = bad;
        records.push_back(r);
    }
    for (int pass = 0; pass < 12; ++pass) {
        const SelectionStatistics statistics =
            selection.update(records, {1.0, 1.0, pass % 3 == 0 ? static_cast<double>(nan) : 1.0});
        EXPECT_TRUE(std::isfinite(statistics.guided_share));
    }
    for (const float bad : {nan, kInfinity, -kInfinity, 1e38f}) {
        const float a = selection.alpha(Vec3(bad), Vec3(bad), true);
        EXPECT_TRUE(a >= 0.0f && a <= 0.75f);
    }
    GuideSelection empty(Bounds3{});
    EXPECT_EQ(empty.alpha(Vec3(0.0f), Vec3(0, 0, 1), false), 0.0f);
    EXPECT_FALSE(empty.update({}, {}).closed);
}

}  // namespace
}  // namespace pharos
