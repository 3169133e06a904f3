def test_the_same_networks_each_time(tiny, tmp_path):
    """The manifest holds their checksums."""
    manifests = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        tiny.write_models(tmp_path / name)
        manifests.append((tmp_path / name / "manifest.toml").read_text())
    assert manifests[0] == manifests[1]
    assert manifests[0].count("sha256") == 5
