// The table of settings: values from text, presets beneath what the user set, JSON.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <jansson.h>

#include "export/clean.h"
#include "export/formats.h"
#include "model/settings.h"

static int setup(void **state)
{
    return (*state = fs_settings_new()) ? 0 : -1;
}

static int teardown(void **state)
{
    fs_settings_free(*state);
    return 0;
}

static void set(FsSettings *s, const char *name, const char *value)
{
    FsError err = {0};
    if (fs_settings_set(s, name, value, &err) < 0) fail_msg("%s", err.message);
}

static void test_every_option_takes_its_own_text(void **state)
{
    size_t n;
    const FsOption *options = fs_settings_options(&n);
    assert_true(n > 20);
    for (size_t i = 0; i < n; i++) {
        char text[400], again[400];
        assert_int_equal(fs_settings_get(*state, options[i].name, text, sizeof text), 0);
        set(*state, options[i].name, text);
        assert_int_equal(fs_settings_get(*state, options[i].name, again, sizeof again), 0);
        assert_string_equal(text, again);
        assert_true(options[i].stages != 0);
        assert_non_null(options[i].help);
        assert_null(strchr(options[i].help, '\n'));
        for (size_t j = 0; j < i; j++) assert_string_not_equal(options[i].name, options[j].name);
    }
}

static void test_out_of_range_is_refused_and_changes_nothing(void **state)
{
    size_t n;
    const FsOption *options = fs_settings_options(&n);
    for (size_t i = 0; i < n; i++) {
        char was[400], is[400], text[64];
        FsError err = {0};
        if (options[i].type == FS_OPTION_STRING) continue;
        fs_settings_get(*state, options[i].name, was, sizeof was);
        snprintf(text, sizeof text, "%.0f", options[i].type == FS_OPTION_ENUM ? 1.0 : options[i].max + 1);
        assert_int_equal(fs_settings_set(*state, options[i].name, text, &err), FS_ERR_USAGE);
        assert_non_null(strstr(err.message, options[i].name));
        assert_int_equal(fs_settings_set(*state, options[i].name, "", &err), FS_ERR_USAGE);
        fs_settings_get(*state, options[i].name, is, sizeof is);
        assert_string_equal(was, is);
    }
    assert_int_equal(fs_settings_set(*state, "none-such", "1", NULL), FS_ERR_USAGE);
    assert_true(fs_settings_get(*state, "none-such", NULL, 0) < 0);
}

static void test_minutes_or_steps(void **state)
{
    FsSettings *other = fs_settings_new();
    FsError err = {0};
    set(*state, "minutes", "2.5");
    set(*state, "preset", "preview"); // whose steps are the most
    assert_int_equal(fs_settings_check(*state, NULL), 0);
    set(other, "minutes", "2.5"); // in any order, the last word counts
    set(other, "steps", "500");
    assert_int_equal(fs_settings_check(other, &err), FS_ERR_USAGE);
    assert_non_null(strstr(err.message, "--steps"));
    set(other, "minutes", "0");
    assert_int_equal(fs_settings_check(other, NULL), 0);
    assert_true(other->steps == 500 && ((FsSettings *)*state)->steps == 2700);
    fs_settings_free(other);
}

static void test_lists_and_ways(void **state)
{
    FsError err = {0};
    Settings *s = *state;
    set(s, "layers", "R,all");
    set(s, "clean", "");
    assert_int_equal(fs_settings_set(s, "layers", "", &err), FS_ERR_USAGE);
    assert_int_equal(fs_settings_set(s, "formats", "", &err), FS_ERR_USAGE);
    assert_int_equal(fs_settings_set(s, "formats", "ply,,spz", &err), FS_ERR_USAGE);
    assert_int_equal(fs_settings_set(s, "formats", ",", &err), FS_ERR_USAGE);
    assert_int_equal(fs_settings_set(s, "formats", "spz,ply,", &err), FS_ERR_USAGE);
    assert_int_equal(fs_settings_set(s, "hard", "frame,", &err), FS_ERR_USAGE);
    assert_int_equal(fs_settings_set(s, "clean", ",", &err), FS_ERR_USAGE);
    assert_int_equal(fs_settings_set(s, "formats", "ply,pl", &err), FS_ERR_USAGE);
    assert_non_null(strstr(err.message, "'pl'"));
    assert_string_equal(s->layers, "R,all");
    set(s, "path", "spiral");
    assert_int_equal(fs_settings_check(s, NULL), 0);
    set(s, "cameras", "model");
    assert_int_equal(fs_settings_check(s, &err), FS_ERR_USAGE);
    assert_non_null(strstr(err.message, "--cameras"));
    set(s, "path", "none");
    assert_int_equal(fs_settings_check(s, NULL), 0);
    set(s, "test-every", "1");
    assert_int_equal(fs_settings_check(s, NULL), FS_ERR_USAGE);
}

static const char *choices_of(const char *name)
{
    size_t n;
    const FsOption *options = fs_settings_options(&n);
    for (size_t i = 0; i < n; i++)
        if (strcmp(options[i].name, name) == 0) return options[i].choices;
    return "";
}

// What a list may name is what the stages have, and what they ask for are its words.
static void test_words_of_lists(void **state)
{
    char names[400] = "";
    Settings *s = *state;
    for (int f = 0; f < FORMATS; f++) sprintf(names + strlen(names), "%s%s", f ? "|" : "", fs_formats[f].name);
    assert_string_equal(choices_of("formats"), names);
    strcpy(names, "all");
    for (int l = 0; l < RENDER_LAYERS; l++) sprintf(names + strlen(names), "|%s", fs_render_layers[l].name);
    assert_string_equal(choices_of("layers"), names);
    set(s, "formats", "spz,ply");
    for (int f = 0; f < FORMATS; f++)
        assert_int_equal(fs_settings_has_word(s->formats, fs_formats[f].name),
                         !strcmp(fs_formats[f].name, "ply") || !strcmp(fs_formats[f].name, "spz"));
    assert_false(fs_settings_has_word(s->formats, ""));
    assert_false(fs_settings_has_word("", "ply"));
    bool wanted[CLEAN_FORMATS];
    fs_clean_wanted("dng,jpeg", wanted);
    assert_true(wanted[CLEAN_JPEG] && !wanted[CLEAN_TIFF] && wanted[CLEAN_DNG]);
}

static void test_what_the_user_sets_wins_over_presets(void **state)
{
    Settings *s = *state;
    int standard = s->steps;
    set(s, "steps", "123");
    set(s, "preset", "preview");
    assert_int_equal(s->steps, 123);
    int preview_edge = s->long_edge;
    set(s, "preset", "paper");
    assert_int_equal(s->steps, 123);
    assert_string_equal(s->geometry, "separate");
    set(s, "geometry", "shared");
    set(s, "preset", "standard");
    assert_string_equal(s->geometry, "shared");
    assert_string_equal(s->beta, "pane"); // the paper's is gone again
    assert_int_not_equal(s->long_edge, preview_edge);
    assert_int_not_equal(standard, 123);
}

static void test_best_is_standard_with_more_steps(void **state)
{
    Settings *s = *state;
    int steps = s->steps, long_edge = s->long_edge, init_count = s->init_count;
    set(s, "preset", "best");
    assert_int_equal(s->steps, 3 * steps);
    assert_int_equal(s->long_edge, long_edge);
    assert_int_equal(s->init_count, init_count);
}

static void test_presets_exist(void **state)
{
    (void)state;
    const char *help, *name;
    size_t n = 0;
    for (; (name = fs_settings_preset(n, &help)); n++) {
        FsSettings *s = fs_settings_new();
        set(s, "preset", name);
        assert_true(*help);
        fs_settings_free(s);
    }
    assert_int_equal(n, 7);
}

static void test_copies_are_deep(void **state)
{
    Settings copy;
    set(*state, "poses", "model");
    assert_int_equal(fs_settings_copy(&copy, *state, NULL), 0);
    set(*state, "poses", "other");
    assert_string_equal(copy.poses, "model");
    fs_settings_clear(&copy);
}

static void test_json_has_the_stages_options(void **state)
{
    set(*state, "steps", "42");
    set(*state, "poses", "a \"quoted\" name\n");
    char *text = fs_settings_json(*state, FS_STAGE_TRAIN | FS_STAGE_POSES);
    json_t *root = json_loads(text, 0, NULL);
    assert_non_null(root);
    assert_int_equal(json_integer_value(json_object_get(root, "steps")), 42);
    assert_string_equal(json_string_value(json_object_get(root, "poses")), "a \"quoted\" name\n");
    assert_null(json_object_get(root, "cameras"));
    json_decref(root);
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_every_option_takes_its_own_text, setup, teardown),
        cmocka_unit_test_setup_teardown(test_out_of_range_is_refused_and_changes_nothing, setup, teardown),
        cmocka_unit_test_setup_teardown(test_minutes_or_steps, setup, teardown),
        cmocka_unit_test_setup_teardown(test_lists_and_ways, setup, teardown),
        cmocka_unit_test_setup_teardown(test_words_of_lists, setup, teardown),
        cmocka_unit_test_setup_teardown(test_what_the_user_sets_wins_over_presets, setup, teardown),
        cmocka_unit_test_setup_teardown(test_best_is_standard_with_more_steps, setup, teardown),
        cmocka_unit_test(test_presets_exist),
        cmocka_unit_test_setup_teardown(test_copies_are_deep, setup, teardown),
        cmocka_unit_test_setup_teardown(test_json_has_the_stages_options, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
