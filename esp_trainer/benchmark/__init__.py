"""Any policy against evolved and scripted teams: how good is it?"""
