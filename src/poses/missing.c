#include "poses/missing.h"

#include <string.h>

enum { MOST_EXPLAINED = 12 };

void fs_missing_names(const Sparse *sparse, const Capture *capture, char *text, size_t size)
{
    size_t used = 0;
    int left = 0;
    text[0] = 0;
    for (int i = 0; i < capture->n; i++) {
        if (sparse->pose[i].known) continue;
        if (used + strlen(capture->photo[i].name) + 24 > size) {
            left++;
            continue;
        }
        used += (size_t)snprintf(text + used, size - used, "%s%s", used ? ", " : "", capture->photo[i].name);
    }
    if (left) snprintf(text + used, size - used, " and %d more", left);
}

// The photo, with or without a pose, that has most in common with photo i.
typedef struct Partner {
    int photo, matches; // -1: none
} Partner;

static int find_partner(const Colmap *colmap, const Sparse *sparse, int i, bool posed, Partner *best, FsError *err)
{
    *best = (Partner){-1, 0};
    for (int k = 0; k < colmap->capture->n; k++) {
        if (k == i || sparse->pose[k].known != posed) continue;
        int n = fs_database_verified(colmap->db, colmap->image_id[i], colmap->image_id[k], err);
        if (n < 0) return n;
        if (n > best->matches) *best = (Partner){k, n};
    }
    return 0;
}

static int explain(const Colmap *colmap, const Sparse *sparse, int i, FsError *err)
{
    const Log *log = &colmap->project->log;
    const Photo *photo = colmap->capture->photo;
    const char *name = photo[i].name;
    Partner posed, other;
    MUST(find_partner(colmap, sparse, i, true, &posed, err));
    MUST(find_partner(colmap, sparse, i, false, &other, err));
    if (posed.matches < FS_COLMAP_FEW_MATCHES && other.matches >= FS_COLMAP_FEW_MATCHES)
        fs_log_warn(log,
                    "%s has no pose and is left out: it goes with %s, which has none either, and not with the others: "
                    "of another place, or photos between are missing",
                    name, photo[other.photo].name);
    else if (posed.matches < FS_COLMAP_FEW_MATCHES)
        fs_log_warn(
            log,
            "%s has no pose and is left out: next to nothing in common with the others (%d matches at most): of "
            "another place, or too far from them",
            name, posed.matches);
    else
        fs_log_warn(log,
                    "%s has no pose and is left out: %d matches with %s, but too few with what other photos see too: "
                    "take more photos around it",
                    name, posed.matches, photo[posed.photo].name);
    return 0;
}

int fs_missing_explain(const Colmap *colmap, const Features *features, const Sparse *sparse, FsError *err)
{
    int said = 0;
    for (int i = 0; i < colmap->capture->n && said < MOST_EXPLAINED; i++) {
        if (sparse->pose[i].known || features[i].n < FS_COLMAP_FEW_FEATURES) continue;
        MUST(explain(colmap, sparse, i, err));
        said++;
    }
    return 0;
}
