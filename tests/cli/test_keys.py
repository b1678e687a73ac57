from rtctl.daemon.keys import load_keys


def test_keys_new_makes_a_pair_once(rtctl, tmp_path):
    code, out, _ = rtctl("keys", "new", "--dir", tmp_path)
    assert code == 0
    assert str(tmp_path / "server.key_secret") in out
    assert load_keys("server", tmp_path)
    code, _, err = rtctl("keys", "new", "--dir", tmp_path)
    assert code == 2
    assert "server.key" in err and "exists" in err


def test_keys_new_says_where_the_client_key_goes(rtctl, tmp_path):
    code, out, _ = rtctl("keys", "new", "alice", "--dir", tmp_path)
    assert code == 0
    assert "alice.key to the daemon's folder `authorized`" in out


def test_invalid_key_name_is_refused(rtctl, tmp_path):
    assert rtctl("keys", "new", "../x", "--dir", tmp_path).code == 2
    assert not list(tmp_path.iterdir())
